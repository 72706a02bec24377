// The encoder of positions of fans; its decoder is in positions_decoder.cpp.
#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "base/bytes.h"
#include "code/efforts.h"
#include "entropy/rans.h"
#include "numbers/number_maps.h"
#include "numbers/refined_numbers.h"
#include "surface/fans/fit_shear.h"
#include "surface/fans/position_choice.h"
#include "surface/fans/positions.h"
#include "surface/patch_topology.h"

namespace maille {

using namespace positions;

namespace {

void apply_shear(const Shear& shear, Codes& codes) {
  for (size_t v = 0; v < codes.size() && shear.any(); ++v) shear.apply(codes[v]);
}

/// The bias is the middle of the codes, and codes are wide if they span 2^21 - 1 or more. `more_range`: how
/// far codes of other patches may lie from those of this one; a shear makes that larger.
CodedNumbers find_range(const Codes& codes, Scalar type, std::vector<NumberMap> maps, const Shear& shear,
                        uint64_t more_range) {
  CodedNumbers numbers{type, std::move(maps), shear};
  more_range *= static_cast<uint64_t>(shear.growth());
  Bias low{}, high{};
  for (size_t v = 0; v < codes.size(); ++v) {
    const int64_t* const code = codes[v];
    for (unsigned k = 0; k < codes.components; ++k) {
      low[k] = v > 0 ? std::min(low[k], code[k]) : code[k];
      high[k] = v > 0 ? std::max(high[k], code[k]) : code[k];
    }
  }
  bool wide = false;
  for (unsigned k = 0; k < codes.components; ++k) {
    const uint64_t range = static_cast<uint64_t>(high[k]) - static_cast<uint64_t>(low[k]);
    wide = wide || range >= 2 * int64_t{most_narrow_code} - 1 || more_range >= uint64_t{most_narrow_code};
    numbers.bias[k] = static_cast<int64_t>(static_cast<uint64_t>(low[k]) + (range + 1) / 2);
  }
  if (wide) numbers.widen();
  return numbers;
}

/// How a patch is coded, and its bytes: all choices are made by the constructor, then one of the write
/// functions is called.
class PositionEncoder {
 public:
  PositionEncoder(Patch patch, CodedNumbers numbers, const Effort& effort, bool exact)
      : patch_(std::move(patch)),
        numbers_(std::move(numbers)),
        chosen_(choose_coding(patch_, numbers_, effort, exact)),
        points_(patch_.size()) {
    // All points are coded already, so the codes, 8 bytes a number, can go.
    if (chosen_.all) patch_.codes = {};
  }

  /// In bytes, as far as trials tell.
  double size() const {
    ByteWriter beside;
    for (const NumberMap& map : numbers_.maps) write_map(beside, map);
    if (numbers_.shear.any()) numbers_.shear.write(beside);
    return chosen_.size + static_cast<double>(beside.size());
  }

  /// `beside`: what stands behind the maps.
  std::vector<std::byte> write(uint8_t flags, Bytes beside) {
    if (!chosen_.all) {
      CodedPoints& all = chosen_.all.emplace();
      code_all(patch_, all.writer);
      write_side(false, all);
    }
    ByteWriter out;
    write_head(flags, beside, out);
    write_points(chosen_.all->writer, chosen_.all->tables, points_, out);
    return out.take();
  }

  /// What stands before points, for many patches of which this one is a sample. Arguments as for write().
  std::vector<std::byte> write_shared(uint8_t flags, Bytes beside) {
    if (!chosen_.all) code_all(patch_, chosen_.all.emplace().writer);
    CodedPoints& all = *chosen_.all;
    write_side(true, all);
    ByteWriter out;
    write_head(flags, beside, out);
    const size_t symbols = write_symbols(chosen_.coding, all.writer.events, all.tables).size();
    bytes_of_point_ = (static_cast<double>(all.writer.raw_bits) / 8 + static_cast<double>(symbols)) / points_;
    patch_.codes = {};
    all.writer = Writer();
    return out.take();
  }
  /// Another patch, after that. Its codes, sheared as those of the sample, span no more than those were said
  /// to.
  void write_with_shared(const Patch& patch, ByteWriter& out) const {
    Writer writer(&chosen_.all->tables);
    code_all(patch, writer);
    write_points(writer, chosen_.all->tables, patch.size(), out);
  }
  bool takes(const Codes& codes) const {
    if (numbers_.wide) return true;
    for (size_t v = 0; v < codes.size(); ++v) {
      const int64_t* const code = codes[v];
      for (unsigned k = 0; k < codes.components; ++k) {
        const auto number =
            static_cast<int64_t>(static_cast<uint64_t>(code[k]) - static_cast<uint64_t>(numbers_.bias[k]));
        // Codes of another patch that floats of the sample's bias cannot hold; such a patch has tables of its
        // own.
        if (number <= -most_narrow_code || number >= most_narrow_code) return false;
      }
    }
    return true;
  }
  const std::vector<NumberMap>& maps() const { return numbers_.maps; }
  const Shear& shear() const { return numbers_.shear; }
  /// Symbols and raw bits of one, as far as trials tell.
  double bytes_of_point() const { return bytes_of_point_; }

 private:
  void code_all(const Patch& patch, Writer& writer) const {
    Runs::make(patch, numbers_.bias, numbers_.maps, numbers_.type, numbers_.wide)
        ->all(chosen_.coding, writer);
  }
  void write_side(bool shared, CodedPoints& all) const {
    RansEncoder side;
    all.tables = positions::write_side(chosen_.coding, all.writer.events, shared, side);
    all.side = side.finish();
  }
  void write_head(uint8_t flags, Bytes beside, ByteWriter& out) const {
    const Coding& coding = chosen_.coding;
    if (patch_.places) out.put(static_cast<uint8_t>(coding.placement));
    out.put_count(flags | flags_of(coding, numbers_.wide) | (numbers_.shear.any() ? flag_sheared : 0u));
    for (const NumberMap& map : numbers_.maps) write_map(out, map);
    out.put_bytes(beside);
    if (numbers_.shear.any()) numbers_.shear.write(out);
    for (unsigned k = 0; k < coding.components && !numbers_.wide; ++k) out.put_zigzag(numbers_.bias[k]);
    for (unsigned k = 0; k < coding.components; ++k) out.put(coding.base[k]);
    out.put(coding.first_size);
    out.put(coding.first_spread);
    put_section(out, chosen_.all->side);
  }
  void write_points(Writer& writer, const std::vector<StaticTables>& tables, uint64_t points,
                    ByteWriter& out) const {
    std::vector<std::byte> symbols = write_symbols(chosen_.coding, writer.events, tables);
    fill_up(symbols, points);
    put_section(out, writer.take_raw());
    out.put_bytes(symbols);
  }

  Patch patch_;
  CodedNumbers numbers_;
  ChosenCoding chosen_;
  uint32_t points_;
  double bytes_of_point_ = 0;
};

/// Places of numbers in an array, rising: components * tuple + component.
using Places = std::vector<uint64_t>;
bool has(const Places& places, uint64_t stored) {
  return std::binary_search(places.begin(), places.end(), stored);
}

/// Exceptions have no code. They take that of the tuple before, so that they disturb predictions least.
Codes codes_of(const Array& array, const Places& exceptions, std::span<const NumberMap> maps,
               std::span<const uint32_t> source) {
  const size_t size = size_of(array.type);
  const unsigned n = array.components;
  Codes codes(n, source.size());
  for (size_t v = 0; v < source.size(); ++v) {
    for (unsigned k = 0; k < n; ++k) {
      const uint64_t stored = uint64_t{source[v]} * n + k;
      if (!exceptions.empty() && has(exceptions, stored)) {
        codes[v][k] = v > 0 ? codes[v - 1][k] : 0;
      } else {
        codes[v][k] = maps[k].code_of(array.type, array.bytes.data() + stored * size);
      }
    }
  }
  return codes;
}

}  // namespace

std::vector<std::byte> write_exceptions(const Array& array, const std::vector<uint64_t>& exceptions,
                                        std::span<const uint32_t> source) {
  ByteWriter numbers;
  uint64_t count = 0, before = 0;
  const unsigned n = array.components;
  for (uint64_t place = 0; place < n * source.size() && !exceptions.empty(); ++place) {
    const uint64_t stored = uint64_t{source[place / n]} * n + place % n;
    if (!has(exceptions, stored)) continue;
    numbers.put_count(place - before);
    numbers.put_bytes(Bytes(array.bytes).subspan(stored * size_of(array.type), size_of(array.type)));
    before = place;
    ++count;
  }
  ByteWriter out;
  out.put_count(count);
  out.put_bytes(numbers.bytes());
  return out.take();
}

namespace {

/// For curved maps: are forecasts of numbers so much better than forecasts of codes that doubles pay? They
/// take twice to three times as long to decode, as each forecast is mapped back to a code. Measured by plain
/// weights, on a sample.
bool forecasts_numbers(const Patch& patch, CodedNumbers numbers, const Effort& effort) {
  Coding plain;
  plain.components = patch.codes.components;
  const auto bits = [&] {
    const auto runs = Runs::make(patch, numbers.bias, numbers.maps, numbers.type, numbers.wide);
    const Measured measured = runs->measure(plain);
    return static_cast<double>(
        std::min(measured.of(Centre::fitted).bits(), measured.of(Centre::gate).bits()));
  };
  const double of_codes = bits();
  numbers.widen();
  const double of_numbers = bits();
  // Files with tables were smaller by ranks up to a ratio of 1.09 and larger from 1.18 on (build/data/tri and
  // poly); with digits ogre, at 1.04, is 5 % larger by codes.
  const double price = !effort.spread ? 1.15 : has_tables(numbers.maps) ? 1.1 : 1.0;
  return price * of_numbers < of_codes;
}

/// With codes as they are or sheared, whichever is smaller by trials of the whole: what fit_shear() promises
/// is an estimate.
PositionEncoder best_encoder(Patch patch, Scalar type, const std::vector<NumberMap>& maps,
                             const Effort& effort, bool exact, uint64_t more_range = 0) {
  const bool curved =
      std::any_of(maps.begin(), maps.end(), [](const NumberMap& map) { return map.is_curved(); });
  const unsigned n = patch.codes.components;
  const Shear shear = n < 2 || curved ? Shear() : fit_shear(*patch.fans, patch.codes.numbers, n);
  CodedNumbers numbers = find_range(patch.codes, type, maps, {}, more_range);
  if (curved && !numbers.wide && forecasts_numbers(patch, numbers, effort)) numbers.widen();
  if (!shear.any()) return PositionEncoder(std::move(patch), std::move(numbers), effort, exact);
  PositionEncoder plain(patch, std::move(numbers), effort, exact);
  apply_shear(shear, patch.codes);
  numbers = find_range(patch.codes, type, maps, shear, more_range);
  PositionEncoder sheared(std::move(patch), std::move(numbers), effort, exact);
  return sheared.size() < plain.size() ? std::move(sheared) : std::move(plain);
}

/// `places`: of arrays, with which all efforts do the same.
std::vector<std::byte> encode_with(const FanSurface& fans, const Array& array, const ArrayMaps& maps,
                                   std::span<const uint32_t> source, const Effort& effort,
                                   const std::optional<ElementPlaces>& places) {
  const auto encoder_of = [&](const std::vector<NumberMap>& by) {
    return best_encoder({&fans, codes_of(array, maps.exceptions, by, source), places}, array.type, by, effort,
                        !places);
  };
  ByteWriter exceptions;
  put_section(exceptions, write_exceptions(array, maps.exceptions, source));
  // Lossless doubles have two ways: exact codes, or coarse codes with details beside them. Both are tried.
  PositionEncoder plain = encoder_of(maps.maps);
  if (maps.lossless) {
    const RefinedMaps refined = refine_maps(array, maps.maps, source);
    if (refined.any() || has_tables(refined.coarse)) {
      PositionEncoder coarse = encoder_of(refined.coarse);
      ByteWriter beside;
      if (refined.any()) {
        write_exact_maps(beside, refined);
        put_section(beside, encode_details(refined, array, source));
      }
      beside.put_bytes(exceptions.bytes());
      if (coarse.size() + static_cast<double>(beside.size()) < plain.size())
        return coarse.write(refined.any() ? flag_refined : 0, beside.bytes());
    }
  }
  return plain.write(0, exceptions.bytes());
}

}  // namespace

std::vector<std::byte> encode_positions(const FanSurface& fans, const Array& array, const ArrayMaps& maps,
                                        std::span<const uint32_t> source, const Effort& effort) {
  return encode_with(fans, array, maps, source, effort, std::nullopt);
}

std::vector<std::byte> encode_numbers(const FanSurface& around, const Array& array, const ArrayMaps& maps,
                                      std::span<const uint32_t> source, const ElementPlaces& places) {
  return encode_with(around, array, maps, source, efforts.back(), places);
}

struct SharedPositions::State {
  PositionEncoder encoder;
  RefinedMaps refined;
  double details_of_point = 0;  ///< bytes

  std::vector<std::byte> write() {
    ByteWriter exact;
    if (refined.any()) write_exact_maps(exact, refined);
    return encoder.write_shared(refined.any() ? flag_refined : 0, exact.bytes());
  }
};

SharedPositions::SharedPositions(const FanSurface& sample, const Array& array, const ArrayMaps& maps,
                                 const Effort& effort, uint64_t most_range, RefinedMaps refined) {
  std::vector<uint32_t> source(sample.vertices);
  std::iota(source.begin(), source.end(), 0u);
  double details = 0;
  if (refined.any())
    details = static_cast<double>(encode_details(refined, array, source).size()) / sample.vertices;
  PositionEncoder encoder = best_encoder({&sample, codes_of(array, maps.exceptions, maps.maps, source)},
                                         array.type, maps.maps, effort, false, most_range);
  state_ = std::make_unique<State>(State{std::move(encoder), std::move(refined), details});
  tables_ = state_->write();
}
SharedPositions::SharedPositions(SharedPositions&&) noexcept = default;
SharedPositions& SharedPositions::operator=(SharedPositions&&) noexcept = default;
SharedPositions::~SharedPositions() = default;

double SharedPositions::size_of(uint64_t points) const {
  return static_cast<double>(tables_.size()) +
         (state_->encoder.bytes_of_point() + state_->details_of_point) * static_cast<double>(points);
}

std::optional<std::vector<std::byte>> SharedPositions::encode(const FanSurface& fans, const Array& array,
                                                              const std::vector<uint64_t>& exceptions,
                                                              std::span<const uint32_t> source) const {
  Patch patch{&fans, codes_of(array, exceptions, state_->encoder.maps(), source)};
  apply_shear(state_->encoder.shear(), patch.codes);
  if (!state_->encoder.takes(patch.codes)) return std::nullopt;
  ByteWriter out;
  if (state_->refined.any()) put_section(out, encode_details(state_->refined, array, source));
  put_section(out, write_exceptions(array, exceptions, source));
  state_->encoder.write_with_shared(patch, out);
  return out.take();
}

}  // namespace maille
