#include "surface/fans/adaptive_positions.h"

#include <string>

#include "base/bytes.h"
#include "base/result.h"
#include "entropy/rans.h"
#include "numbers/number_maps.h"
#include "surface/fans/adaptive_position_coder.h"
#include "surface/fans/model_states.h"

namespace maille {
namespace {

using Centre = AdaptiveCoding::Centre;
using Repeats = AdaptiveCoding::Repeats;

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("positions: ") + what);
}

// Of dictionaries that stand before the first charts of a file, which shall be in its first 64 KiB.
constexpr size_t most_shared_entries = 8192;
// Vertices that codings are tried on.
constexpr uint32_t trial_vertices = 1 << 14;

/// What stands before the vertices in the coded sequence. False: what damaged bytes say cannot be.
template <class Coder>
bool code_side(Coder& coder, AdaptiveCoding& coding) {
  coding.rows.code(coder);
  for (unsigned k = 0; k < 3 && coding.repeats != Repeats::none; ++k) {
    if (!coding.dictionaries[k].code(coder)) return false;
  }
  return !coder.exhausted();
}

/// What models know before, and where to put what they know then.
struct ModelsAround {
  const AdaptivePositionModels* start = nullptr;
  std::unique_ptr<AdaptivePositionModels>* end = nullptr;
};

/// The first `count` vertices.
template <class Coder, bool curved, bool repeating>
void code_vertices(Coder& coder, const AdaptiveCoding& coding, const FanSurface& fans, AdaptivePoints& points,
                   std::span<const Codes3> wanted, uint32_t count, const ModelsAround& models) {
  AdaptivePositionCoder<Coder, curved, repeating> positions(coder, coding, fans, points, wanted,
                                                            models.start);
  for (uint32_t v = 0; v < count && !coder.exhausted(); ++v) positions.code(v);
  if (models.end != nullptr) *models.end = std::make_unique<AdaptivePositionModels>(positions.models());
}
template <class Coder>
void code_vertices(Coder& coder, const AdaptiveCoding& coding, const FanSurface& fans, AdaptivePoints& points,
                   std::span<const Codes3> wanted, uint32_t count, const ModelsAround& models = {}) {
#ifdef __EMSCRIPTEN__
  // Which does what the others do: each would be 10 KB to wait for.
  const auto code = code_vertices<Coder, true, true>;
#else
  const bool repeating = coding.repeats != Repeats::none;
  const auto code =
      points.any_curved()
          ? (repeating ? code_vertices<Coder, true, true> : code_vertices<Coder, true, false>)
          : (repeating ? code_vertices<Coder, false, true> : code_vertices<Coder, false, false>);
#endif
  code(coder, coding, fans, points, wanted, count, models);
}

/// Chooses a coding for codes by vertex, and writes them.
class AdaptivePositionEncoder {
 public:
  /// `all`: where these are a sample, what it is one of; else empty.
  AdaptivePositionEncoder(const FanSurface& fans, std::span<const NumberMap> maps, std::vector<Codes3> codes,
                          std::vector<Codes3> all)
      : fans_(fans), maps_(maps), codes_(std::move(codes)), all_(std::move(all)) {}

  /// The coding of which all takes the least, as far as trials tell, and the bytes it takes then.
  struct Choice {
    AdaptiveCoding coding;
    double size = 0;
  };
  Choice choose() {
    AdaptiveCoding best;
    best.rows = fit();
    AdaptiveCoding other = best;
    other.centre = Centre::gate;
    choose_bases(best);
    choose_bases(other);
    double smallest = trial(best);
    // The longer ways to decode must save something.
    const auto consider = [&](const AdaptiveCoding& coding, double gain) {
      const double size = trial(coding);
      if (size > gain * smallest) return;
      smallest = size;
      best = coding;
    };
    consider(other, 1);
    const Choice plain{best, smallest};
    other.repeats = Repeats::candidates;
    consider(other, 0.98);
    const auto counts = count_values();
    for (const Often& often : {Often{8, 2}, Often{8, 0}, Often{32, 0}, Often{128, 0}}) {
      double share = 0;
      for (unsigned k = 0; k < 3; ++k) share += fill(counts[k], often, other.dictionaries[k]);
      if (share < 0.1) continue;
      if (!all_.empty() && entries(other) > most_shared_entries) continue;
      other.repeats = Repeats::levels;
      for (const Centre centre : {Centre::fitted, Centre::gate}) {
        other.centre = centre;
        consider(other, 0.98);
      }
      other.repeats = Repeats::candidates;
      consider(other, 0.98);
    }
    other = best;
    other.centre = best.centre == Centre::gate ? Centre::fitted : Centre::gate;
    if (best.repeats != Repeats::none) consider(other, 1);
    return best.repeats == Repeats::none || pays(best, plain.coding) ? Choice{best, smallest} : plain;
  }

  std::vector<std::byte> write(AdaptiveCoding& coding, uint32_t count) const {
    RansEncoder encoder(3);
    code_side(encoder, coding);
    AdaptivePoints points(count, maps_);
    code_vertices(encoder, coding, fans_, points, codes_, count);
    return encoder.finish();
  }

 private:
  ValenceRows fit() const {
    const AdaptivePoints points(0, maps_);
    std::vector<std::array<double, 3>> values(codes_.size());
    std::array<double, 3> largest{}, units{};
    for (size_t v = 0; v < codes_.size(); ++v) {
      for (unsigned k = 0; k < 3; ++k) {
        values[v][k] = points.value_of(k, codes_[v][k]);
        largest[k] = std::max(largest[k], std::fabs(values[v][k]));
      }
    }
    for (unsigned k = 0; k < 3; ++k)
      units[k] = points.curved[k] ? largest_step(points, k, std::max(largest[k], 1e-30)) : 1;
    return fit_valence_rows(fans_, values, units);
  }

  /// Between the largest numbers; a float has steps of 2^-24 of it at least.
  static double largest_step(const AdaptivePoints& points, unsigned k, double largest) {
    const int64_t code = points.curved[k]->nearest_code(Scalar::f32, largest);
    const double below = points.curved[k]->value_of(Scalar::f32, code - 1);
    return std::max(largest - below, largest * 0x1p-24);
  }

  /// So that most residuals take no second symbol.
  void choose_bases(AdaptiveCoding& coding) const {
    const auto count = static_cast<uint32_t>(std::min<size_t>(codes_.size(), trial_vertices));
    AdaptivePoints points(count, maps_);
    std::array<std::array<uint32_t, 34>, 3> lengths{};
    const auto visit = [&](const auto& expecter) {
      Expectation expected;
      for (uint32_t v = 0; v < count; ++v) {
        if (v < fans_.vertices) {
          expecter.expect(fans_.references[v], fans_.kinds[v], v, expected);
          for (unsigned k = 0; k < 3; ++k) {
            const int32_t residual = wrapped_difference(codes_[v][k], expected.centre[k]);
            ++lengths[k][residual_length(static_cast<uint32_t>(magnitude(residual)))];
          }
        }
        points.codes[v] = codes_[v];
        for (unsigned k = 0; k < 3; ++k) points.values[v][k] = points.value_of(k, codes_[v][k]);
      }
    };
    if (points.any_curved()) {
      visit(Expecter<true>(points, coding, fans_.valences.data()));
    } else {
      visit(Expecter<false>(points, coding, fans_.valences.data()));
    }
    for (unsigned k = 0; k < 3; ++k) {
      uint64_t least = UINT64_MAX;
      for (unsigned base = 0; base < 16; ++base) {
        uint64_t cost = 0;
        for (unsigned length = 0; length < 34; ++length) {
          if (base > 0 && length <= base) cost += 3 * lengths[k][length];
          if (length >= base + 15) cost += 5 * lengths[k][length];
        }
        if (cost >= least) continue;
        least = cost;
        coding.base[k] = static_cast<uint8_t>(base);
      }
    }
  }

  using Counts = std::vector<std::pair<int32_t, uint32_t>>;
  std::array<Counts, 3> count_values() const {
    std::array<Counts, 3> result;
    std::vector<int32_t> sorted(all().size());
    for (unsigned k = 0; k < 3; ++k) {
      for (size_t v = 0; v < sorted.size(); ++v) sorted[v] = all()[v][k];
      std::sort(sorted.begin(), sorted.end());
      for (size_t i = 0; i < sorted.size();) {
        const auto end = static_cast<size_t>(
            std::upper_bound(sorted.begin() + static_cast<std::ptrdiff_t>(i), sorted.end(), sorted[i]) -
            sorted.begin());
        result[k].push_back({sorted[i], static_cast<uint32_t>(end - i)});
        i = end;
      }
    }
    return result;
  }
  /// How often values are in a dictionary at least, and how many times as often as those near them. On a
  /// coarse lattice all values come again, in a mesh of many points more often than any number says; those of
  /// a voxel lattice are seen among them.
  struct Often {
    uint64_t least;
    uint64_t times;
  };
  /// Those that are there so often; returns the share of all numbers that they are.
  double fill(const Counts& counts, const Often& often, ValueDictionary& dictionary) const {
    constexpr size_t near = 16;
    std::vector<uint64_t> below{0};
    for (const auto& [value, count] : counts) below.push_back(below.back() + count);
    std::vector<int32_t> values;
    uint64_t covered = 0;
    for (size_t i = 0; i < counts.size(); ++i) {
      const auto& [value, count] = counts[i];
      const size_t first = i - std::min(i, near), end = std::min(i + near + 1, counts.size());
      const bool stands_out = count * (end - first) >= often.times * (below[end] - below[first]);
      if (count < often.least || !stands_out || values.size() == ValueDictionary::most) continue;
      values.push_back(value);
      covered += count;
    }
    dictionary.set(std::move(values));
    return static_cast<double>(covered) / (3.0 * static_cast<double>(all().size() + 1));
  }

  /// Is all as much smaller as its beginning?
  bool pays(AdaptiveCoding coding, AdaptiveCoding plain) const {
    const auto count = static_cast<uint32_t>(codes_.size());
    if (count <= trial_vertices) return true;
    return 100 * write(coding, count).size() < 98 * write(plain, count).size();
  }

  /// About the size of all, from the first vertices.
  double trial(AdaptiveCoding coding) const {
    const auto count = static_cast<uint32_t>(std::min<size_t>(codes_.size(), trial_vertices));
    const double side = static_cast<double>(write(coding, 0).size());
    const double size = static_cast<double>(write(coding, count).size()) - side;
    return side + size * static_cast<double>(all().size()) / std::max(count, 1u);
  }

  const std::vector<Codes3>& all() const { return all_.empty() ? codes_ : all_; }
  static size_t entries(const AdaptiveCoding& coding) {
    size_t sum = 0;
    for (const ValueDictionary& dictionary : coding.dictionaries) sum += dictionary.size();
    return sum;
  }

  const FanSurface& fans_;
  std::span<const NumberMap> maps_;
  std::vector<Codes3> codes_;
  std::vector<Codes3> all_;
};

std::vector<Codes3> codes_of(const Array& array, std::span<const NumberMap> maps,
                             std::span<const uint32_t> source) {
  const size_t size = size_of(array.type);
  std::vector<Codes3> codes(source.size());
  for (size_t v = 0; v < codes.size(); ++v) {
    for (unsigned k = 0; k < 3; ++k) {
      const std::byte* number = array.bytes.data() + (size_t{source[v]} * 3 + k) * size;
      codes[v][k] = static_cast<int32_t>(maps[k].code_of(array.type, number));
    }
  }
  return codes;
}

std::vector<Codes3> all_codes(const Array* array, std::span<const NumberMap> maps) {
  if (array == nullptr) return {};
  std::vector<uint32_t> all(array->count());
  for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  return codes_of(*array, maps, all);
}

void put_head(ByteWriter& out, std::span<const NumberMap> maps, const AdaptiveCoding& coding) {
  out.put(static_cast<uint8_t>(static_cast<unsigned>(coding.centre) | static_cast<unsigned>(coding.repeats)
                                                                          << 1));
  for (const NumberMap& map : maps) write_map(out, map);
  for (const uint8_t base : coding.base) out.put(base);
}

/// Positions with these maps, and how they are coded best.
class PositionsToCode {
 public:
  PositionsToCode(const FanSurface& fans, const Array& array, std::vector<NumberMap> maps,
                  std::span<const uint32_t> source, const Array* all = nullptr)
      : maps_(std::move(maps)),
        count_(static_cast<uint32_t>(source.size())),
        encoder_(fans, maps_, codes_of(array, maps_, source), all_codes(all, maps_)),
        choice_(encoder_.choose()) {
    for (const NumberMap& map : maps_) write_map(written_maps_, map);
  }
  PositionsToCode(const PositionsToCode&) = delete;
  PositionsToCode& operator=(const PositionsToCode&) = delete;

  /// In bytes, as far as trials tell.
  double size() const { return choice_.size + static_cast<double>(written_maps_.size()); }

  std::vector<std::byte> write() {
    ByteWriter out;
    put_head(out, maps_, choice_.coding);
    out.put_bytes(encoder_.write(choice_.coding, count_));
    return out.take();
  }

 private:
  std::vector<NumberMap> maps_;
  uint32_t count_;
  AdaptivePositionEncoder encoder_;
  AdaptivePositionEncoder::Choice choice_;
  ByteWriter written_maps_;
};

constexpr uint8_t most_flags = 1 | 2 << 1;

Result<> check_counts(const FanSurface& fans, Bytes bytes, uint32_t points) {
  // A vertex has three symbols at least, of 2^-8 bit or more.
  if (points / 1024 > bytes.size() + 16) return corrupt("there are more than the stream can hold");
  if (points < fans.vertices) return corrupt("there are fewer than vertices");
  return {};
}

/// The vertices, behind what stands before them.
Result<> decode_vertices(RansDecoder& decoder, const AdaptiveCoding& coding, const FanSurface& fans,
                         std::span<const NumberMap> maps, uint32_t points, Array& array,
                         const ModelsAround& models) {
  AdaptivePoints decoded(points, maps);
  code_vertices(decoder, coding, fans, decoded, std::span<const Codes3>(), points, models);
  if (decoder.exhausted()) return corrupt("the stream ends early");
  std::vector<std::array<double, 3>>().swap(decoded.values);
  const size_t size = size_of(array.type);
  reserve_pages(array.bytes, size_t{points} * array.tuple_size());
  array.bytes.resize(size_t{points} * array.tuple_size());
  if (points == 0) return {};  // nor is there memory to point into
  const auto* codes = reinterpret_cast<const std::byte*>(decoded.codes.data());
  for (unsigned k = 0; k < 3; ++k)
    maps[k].store_numbers(array.type, codes + 4 * size_t{k}, array.bytes.data() + k * size, 3, points);
  return {};
}

}  // namespace

std::vector<std::byte> encode_adaptive_positions(const FanSurface& fans, const Array& array,
                                                 const ArrayMaps& maps, std::span<const uint32_t> source) {
  PositionsToCode best(fans, array, maps.maps, source);
  if (maps.lossless) {
    std::vector<NumberMap> tables = with_tables(array, maps.maps, source);
    const auto has_table = [](const NumberMap& map) { return !map.table.empty(); };
    if (std::any_of(tables.begin(), tables.end(), has_table)) {
      PositionsToCode ranks(fans, array, std::move(tables), source);
      if (ranks.size() < best.size()) return ranks.write();
    }
  }
  return best.write();
}

std::vector<std::byte> encode_position_sample(const FanSurface& fans, const Array& array,
                                              const ArrayMaps& maps, std::span<const uint32_t> source,
                                              const Array& all) {
  return PositionsToCode(fans, array, maps.maps, source, &all).write();
}

std::vector<std::byte> encode_adaptive_positions(const FanSurface& fans, const Array& array,
                                                 std::span<const uint32_t> source,
                                                 const PositionsStart& start) {
  const std::vector<Codes3> codes = codes_of(array, start.maps, source);
  RansEncoder encoder(3);
  AdaptivePoints points(codes.size(), start.maps);
  code_vertices(encoder, start.coding, fans, points, codes, static_cast<uint32_t>(codes.size()),
                {start.models.get()});
  return encoder.finish();
}

Result<> decode_adaptive_positions(const FanSurface& fans, Bytes bytes, uint32_t points, Array& array,
                                   const PositionsStart& start) {
  if (size_of(array.type) > 4) return corrupt("the type is too wide");
  MAILLE_CHECK(check_counts(fans, bytes, points));
  RansDecoder decoder(bytes, 3);
  return decode_vertices(decoder, start.coding, fans, start.maps, points, array, {start.models.get()});
}

std::vector<std::byte> write_positions_head(const PositionsStart& start) {
  ByteWriter out;
  put_head(out, start.maps, start.coding);
  return out.take();
}

Result<PositionsStart> read_positions_head(ByteReader& in, Scalar type) {
  const auto flags = in.get<uint8_t>();
  if (!in.ok() || flags > most_flags) return corrupt("coded in an unknown way");
  if (size_of(type) > 4) return corrupt("the type is too wide");
  PositionsStart read;
  for (unsigned k = 0; k < 3; ++k) read.maps.push_back(MAILLE_TRY(read_map(in, type)));
  AdaptiveCoding& coding = read.coding;
  coding.centre = static_cast<Centre>(flags & 1);
  coding.repeats = static_cast<Repeats>(flags >> 1);
  for (uint8_t& base : coding.base) base = in.get<uint8_t>();
  if (!in.ok() || *std::max_element(coding.base.begin(), coding.base.end()) > 15)
    return corrupt("coded in an impossible way");
  return read;
}

void code_positions_start(RansEncoder& encoder, PositionsStart& start) {
  code_side(encoder, start.coding);
  ModelStateCoder states(encoder);
  start.models->visit_models(states);
}

Result<> code_positions_start(RansDecoder& decoder, PositionsStart& start) {
  if (!code_side(decoder, start.coding)) return corrupt("the dictionaries are damaged");
  start.models = std::make_unique<AdaptivePositionModels>(start.coding.repeats);
  ModelStateCoder states(decoder);
  start.models->visit_models(states);
  return {};
}

Result<> decode_adaptive_positions(const FanSurface& fans, Bytes bytes, uint32_t points, Array& array,
                                   PositionsStart* end) {
  ByteReader in(bytes);
  PositionsStart read = MAILLE_TRY(read_positions_head(in, array.type));
  MAILLE_CHECK(check_counts(fans, bytes, points));

  RansDecoder decoder(in.get_bytes(in.remaining()), 3);
  if (!code_side(decoder, read.coding)) return corrupt("the dictionaries are damaged");
  ModelsAround models;
  if (end != nullptr) models.end = &read.models;
  MAILLE_CHECK(decode_vertices(decoder, read.coding, fans, read.maps, points, array, models));
  if (end != nullptr) *end = std::move(read);
  return {};
}

}  // namespace maille
