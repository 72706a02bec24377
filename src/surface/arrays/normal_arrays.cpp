#include "surface/arrays/normal_arrays.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "base/bytes.h"
#include "base/pages.h"
#include "base/result.h"
#include "entropy/rans.h"
#include "numbers/number_maps.h"
#include "surface/arrays/facet_candidates.h"
#include "surface/arrays/normal_walk.h"
#include "surface/arrays/octahedral_tuples.h"

namespace maille {
namespace {

// So many elements a coding is tried on: enough to fill the models, few enough to try several. Chosen, not
// swept.
constexpr uint32_t trial_elements = 1 << 15;

/// Codes the first `most` elements, or those until `pace` stops; a trial and the whole are the same function.
template <class Code>
std::vector<std::byte> encode_codes(const PatchElements& elements, const std::vector<uint32_t>& face_of,
                                    const Array& array, const ArrayMaps& maps, const ArrayCoding& coding,
                                    std::span<Code> codes, uint32_t most, Pace* pace) {
  RansEncoder encoder(1);
  code_array<RansEncoder, Code>(encoder, elements, face_of, array, array.count(), maps, coding, codes,
                                [&] { return most-- > 0 && (!pace || pace->step()); });
  return encoder.finish();
}

/// Three numbers for each face, whose corners' positions tell more of them than neighbours do.
bool is_facet_normal(const PatchElements& elements, const Array& array, const ArrayMaps& maps) {
  return is_normal(elements, array) && array.domain == Domain::cell && !maps.octahedral;
}

/// Stands where normals are coded, and measures how far they are from those expected: the sum of half octaves
/// of the distance, as bits go with its logarithm.
template <class Code>
class NormalMeasure {
 public:
  NormalMeasure(const Array& array, const ArrayMaps& maps, std::span<const Code> codes)
      : array_(array), maps_(maps), codes_(codes) {}

  void code(uint32_t element, const ElementStencil&, const ExpectedNormal& expected) {
    const Vector3 value = normal_of_codes<Code>(array_.type, maps_, &codes_[element * maps_.maps.size()]);
    const Vector3 unit = unit_vector(expected.vector);
    ++normals_;
    units_ += std::fabs(dot(value, value) - 1) < 0.02;
    for (const bool summed : {false, true}) {
      for (const bool inward : {false, true}) {
        const Vector3 towards = (summed ? expected.vector : unit) * (inward ? -1.0 : 1.0);
        // Below this all are exact; the logarithm of 0 would rule the sum.
        double error = 1e-9;
        for (unsigned k = 0; k < 3; ++k) error = std::max(error, std::fabs(value[k] - towards[k]));
        errors_[summed][inward] += half_octaves_of(std::min(error, 1e30));
      }
    }
  }
  void copy(uint32_t, uint32_t) {}

  /// Are nearly all normals of unit length?
  bool unit() const { return units_ * 64 >= normals_ * 63; }
  int64_t error(bool summed, bool inward) const { return errors_[summed][inward]; }

 private:
  const Array& array_;
  const ArrayMaps& maps_;
  std::span<const Code> codes_;
  int64_t errors_[2][2] = {};
  uint64_t normals_ = 0;
  uint64_t units_ = 0;
};

/// What fits an array's normals best, before anything is tried.
template <class Code>
std::vector<NormalCoding> normal_candidates(const PatchElements& elements,
                                            const std::vector<uint32_t>& face_of, const Array& array,
                                            const ArrayMaps& maps, std::span<const Code> codes) {
  NormalCoding best;
  int64_t smallest = INT64_MAX;
  bool unit = true;
  const auto measure = [&](unsigned weight, bool welded) {
    ArrayCoding coding;
    coding.normal = NormalCoding{static_cast<uint8_t>(weight)};
    coding.normal->welded = welded;
    ExpectedNormals normals(elements, face_of, array.domain, coding);
    NormalMeasure<Code> measured(array, maps, codes);
    RansEncoder unused(1);
    uint32_t most = trial_elements;
    code_elements<RansEncoder, Code>(elements, face_of, array.domain, array.count(), normals, unused, codes,
                                     maps.maps.size(), measured, [&] { return most-- > 0; });
    unit = maps.octahedral || measured.unit();
    for (const bool inward : {false, true}) {
      if (measured.error(!unit, inward) >= smallest) continue;
      smallest = measured.error(!unit, inward);
      best = {static_cast<uint8_t>(weight), unit, !unit, inward};
      best.welded = welded;
    }
  };
  // A face has one normal whatever its weight, so one measure is enough.
  const unsigned weights = array.domain == Domain::cell ? 1 : normal_weight_count;
  for (unsigned weight = 0; weight < weights; ++weight) measure(weight, false);
  if (array.domain == Domain::point || !elements.twins.empty()) measure(best.weight, true);
  NormalCoding following = best;
  following.follows = true;
  // The best expectation, the same with what neighbours have beside theirs, and none at all.
  return {best, following, {NormalCoding::own, unit}};
}

/// The coding whose trial is smallest.
template <class Code>
ArrayCoding choose_coding(const PatchElements& elements, const std::vector<uint32_t>& face_of,
                          const Array& array, const ArrayMaps& maps, std::span<Code> codes) {
  ArrayCoding best;
  size_t smallest = SIZE_MAX;
  const auto consider = [&](const ArrayCoding& coding) {
    const size_t size =
        encode_codes<Code>(elements, face_of, array, maps, coding, codes, trial_elements, nullptr).size();
    if (size >= smallest) return;
    smallest = size;
    best = coding;
  };
  if (is_facet_normal(elements, array, maps)) {
    for (const FacetCoding& coding :
         FacetSample<Code>(elements, face_of, array.type, maps, codes).candidates())
      consider({{}, coding});
    return best;
  }
  for (const NormalCoding& coding : normal_candidates<Code>(elements, face_of, array, maps, codes))
    consider({coding, {}});
  ArrayCoding other = best;
  other.normal->repeats = !best.normal->repeats;
  consider(other);
  return best;
}

/// The maps of a stream of normals; with `octahedral` two of whole numbers, which are not in the file.
Result<ArrayMaps> read_maps(ByteReader& in, const Array& array, bool octahedral) {
  ArrayMaps maps;
  if (!octahedral) {
    for (uint32_t k = 0; k < array.components; ++k) maps.maps.push_back(MAILLE_TRY(read_map(in, array.type)));
    return maps;
  }
  const uint64_t steps = in.get_count();
  if (!in.ok() || steps == 0 || steps > most_octahedral_steps || array.components != 3 ||
      !is_float(array.type)) {
    return failure(ErrorCode::corrupt, "array \"" + array.name + "\" has an impossible map of unit vectors");
  }
  maps.maps.resize(2);
  maps.octahedral = OctahedralMap{static_cast<int32_t>(steps)};
  return maps;
}

/// The place of a number in coded order, which is the only one that both sides share for every domain:
/// corners are numbered by half-edges.
struct NumberPlace {
  uint64_t coded;
  uint64_t stored;  ///< tuple * components + component in the array
};

/// Numbers a lattice cannot hold, bit for bit, by their places in coded order. `tuple_of` gives the tuple of
/// each element.
template <class TupleOf>
void write_exceptions(ByteWriter& out, const Array& array, const ArrayMaps& maps, ElementWalk walk,
                      TupleOf tuple_of) {
  std::vector<NumberPlace> places;
  uint64_t coded = 0;
  const auto find = [&](uint32_t element, const ElementStencil&) {
    for (uint32_t k = 0; k < array.components; ++k, ++coded) {
      const uint64_t stored = tuple_of(element) * array.components + k;
      if (std::binary_search(maps.exceptions.begin(), maps.exceptions.end(), stored))
        places.push_back({coded, stored});
    }
    return true;
  };
  if (!maps.exceptions.empty()) walk.run(array.domain, array.count(), find);
  out.put_count(places.size());
  uint64_t before = 0;
  for (const NumberPlace& place : places) {
    out.put_count(place.coded - before);
    out.put_bytes(Bytes(array.bytes).subspan(place.stored * size_of(array.type), size_of(array.type)));
    before = place.coded;
  }
}

Result<> read_exceptions(Bytes bytes, ElementWalk walk, uint64_t tuples, Array& array) {
  const size_t number_bytes = size_of(array.type);
  ByteReader in(bytes);
  uint64_t left = in.get_count();
  uint64_t next = left > 0 ? in.get_count() : 0;
  uint64_t coded = 0;
  // The walk visits elements once, in coded order, so a list of any length takes linear time.
  const auto take = [&](uint32_t element, const ElementStencil&) {
    for (uint32_t k = 0; k < array.components; ++k, ++coded) {
      if (left == 0 || coded != next) continue;
      const Bytes number = in.get_bytes(number_bytes);
      const size_t place = (size_t{element} * array.components + k) * number_bytes;
      std::copy(number.begin(), number.end(), array.bytes.begin() + static_cast<ptrdiff_t>(place));
      if (--left > 0) next += in.get_count();
    }
    return left > 0 && in.ok();
  };
  if (left > 0 && in.ok()) walk.run(array.domain, tuples, take);
  if (left > 0 || !in.ok() || in.remaining() > 0) {
    return failure(ErrorCode::corrupt, "array \"" + array.name + "\" has a damaged list of special numbers");
  }
  return {};
}

/// The codes of one tuple.
template <class Code>
void fill_codes(const Array& array, const ArrayMaps& maps, uint64_t tuple, Code* codes) {
  const std::byte* numbers = array.bytes.data() + tuple * array.tuple_size();
  const size_t number_bytes = size_of(array.type);
  if (maps.octahedral) {
    // Vectors that are none (exceptions) have no codes: any will do.
    const bool exception = std::binary_search(maps.exceptions.begin(), maps.exceptions.end(), 3 * tuple);
    const auto pair =
        exception ? std::array<int32_t, 2>{} : codes_of_tuple(*maps.octahedral, array.type, numbers);
    codes[0] = pair[0];
    codes[1] = pair[1];
    return;
  }
  for (size_t k = 0; k < maps.maps.size(); ++k) {
    codes[k] = static_cast<Code>(maps.maps[k].code_of(array.type, numbers + k * number_bytes));
  }
}

/// As a section, so that a decoder can read it behind the codes, which the numbers replace.
void put_exceptions(ByteWriter& out, const PatchElements& elements, const std::vector<uint32_t>& face_of,
                    const Array& array, const ArrayMaps& maps, std::span<const uint32_t> source) {
  ByteWriter exceptions;
  write_exceptions(exceptions, array, maps, ElementWalk(elements, face_of),
                   [&](uint32_t element) { return uint64_t{source[element]}; });
  out.put_count(exceptions.size());
  out.put_bytes(exceptions.bytes());
}

/// Three fields: formula, flags with the step in the lowest two bits, scale (13.6).
void write_facet_coding(ByteWriter& out, const FacetCoding& coding) {
  out.put(coding.formula.bits);
  out.put(static_cast<uint8_t>(static_cast<unsigned>(coding.rounding.step) | unsigned{coding.learns} << 2 |
                               unsigned{coding.unit} << 3 | unsigned{coding.signed_zeros} << 4));
  out.put(coding.rounding.scale);
}

/// No value for one that is unknown.
std::optional<FacetCoding> read_facet_coding(ByteReader& in) {
  FacetCoding coding;
  coding.formula.bits = in.get<uint8_t>();
  const auto flags = in.get<uint8_t>();
  const unsigned step = flags & 3;
  coding.rounding = {static_cast<Rounding::Step>(step), in.get<int16_t>()};
  coding.learns = (flags & 4) != 0;
  coding.unit = (flags & 8) != 0;
  coding.signed_zeros = (flags & 16) != 0;
  if (coding.formula.bits >= FacetFormula::count || step >= Rounding::step_count || flags > 31 ||
      std::abs(coding.rounding.scale) > Rounding::most_scale)
    return std::nullopt;
  return coding;
}

/// Everything of a stream but its choice of 32 or 64 bits: head, maps, exceptions, codes.
template <class Code>
std::vector<std::byte> encode_as(const PatchElements& elements, const Array& array, const ArrayMaps& maps,
                                 std::span<const uint32_t> source, Pace* pace) {
  std::vector<Code> codes(source.size() * maps.maps.size());
  for (size_t i = 0; i < source.size(); ++i) {
    // Gaps have codes of 0, which nobody looks at.
    if (source[i] != none) fill_codes(array, maps, source[i], codes.data() + i * maps.maps.size());
  }
  const std::vector<uint32_t> face_of = faces_of_half_edges(*elements.surface, array.domain);
  const ArrayCoding coding = choose_coding<Code>(elements, face_of, array, maps, codes);
  ByteWriter out;
  if (coding.facet) {
    out.put(facet_coding);
    out.put(uint8_t{0});
    write_facet_coding(out, *coding.facet);
  } else {
    out.put(normal_coding);
    out.put(static_cast<uint8_t>(maps.octahedral.has_value() << 2));
    out.put(coding.normal->weight);
    out.put(coding.normal->flags());
  }
  if (maps.octahedral) {
    out.put_count(static_cast<uint64_t>(maps.octahedral->steps));
  } else {
    for (const NumberMap& map : maps.maps) write_map(out, map);
  }
  put_exceptions(out, elements, face_of, array, maps, source);
  out.put_bytes(encode_codes<Code>(elements, face_of, array, maps, coding, codes, none, pace));
  return out.take();
}

/// Turns codes into numbers, in place where both have the same size.
template <class Code>
Result<> store_numbers(Array& array, std::span<const NumberMap> maps, std::vector<std::byte>&& codes) {
  const size_t number_bytes = size_of(array.type);
  const size_t count = codes.size() / sizeof(Code);
  std::vector<std::byte> separate;
  if (number_bytes != sizeof(Code)) separate.resize(count * number_bytes);
  std::byte* const out = separate.empty() ? codes.data() : separate.data();
  for (size_t k = 0; k < maps.size() && count > 0; ++k) {
    maps[k].store_numbers(array.type, codes.data() + k * sizeof(Code), out + k * number_bytes, maps.size(),
                          count / maps.size());
  }
  array.bytes = number_bytes == sizeof(Code) ? std::move(codes) : std::move(separate);
  return {};
}

/// The same where many elements have the tuple of another one, as corners do: each is computed once.
/// `tuple_of`: by element.
template <class Code>
void store_distinct(Array& array, std::span<const NumberMap> maps, std::span<const uint32_t> tuple_of,
                    std::span<const Code> codes) {
  const size_t components = maps.size(), number_bytes = size_of(array.type), size = array.tuple_size();
  const size_t tuples =
      tuple_of.empty() ? 0 : *std::max_element(tuple_of.begin(), tuple_of.end()) + size_t{1};
  std::vector<Code> distinct(tuples * components);
  for (size_t i = 0; i < tuple_of.size(); ++i)
    std::copy_n(codes.data() + i * components, components, distinct.data() + tuple_of[i] * components);
  std::vector<std::byte> numbers(tuples * size);
  for (size_t k = 0; k < components && tuples > 0; ++k) {
    maps[k].store_numbers(array.type, reinterpret_cast<const std::byte*>(distinct.data() + k),
                          numbers.data() + k * number_bytes, components, tuples);
  }
  array.bytes.resize(tuple_of.size() * size);
  for (size_t i = 0; i < tuple_of.size(); ++i)
    std::copy_n(numbers.data() + tuple_of[i] * size, size, array.bytes.data() + i * size);
}

/// The same for unit vectors, two codes each.
template <class Code>
void store_vectors(Array& array, const OctahedralMap& map, std::span<const Code> codes) {
  array.bytes.resize(codes.size() / 2 * array.tuple_size());
  for (size_t i = 0; i < codes.size() / 2; ++i) {
    store_tuple(map, {static_cast<int32_t>(codes[2 * i]), static_cast<int32_t>(codes[2 * i + 1])}, array.type,
                array.bytes.data() + i * array.tuple_size());
  }
}

template <class Code>
Result<> decode_as(const PatchElements& elements, const ArrayCoding& coding, const ArrayMaps& maps,
                   Bytes bytes, Bytes exceptions, uint64_t tuples, Array& array, Pace* pace) {
  // A tuple is at least one decision, and a bit holds at most 2^11 of them: a larger claim cannot be true.
  if (tuples / 16384 > bytes.size() + 16) {
    return failure(ErrorCode::corrupt,
                   "array \"" + array.name + "\" has more tuples than its stream can hold");
  }
  std::vector<std::byte> storage;
  // Bounded by the check above, and by the decoded topology, of which there are so many elements.
  reserve_pages(storage, tuples * maps.maps.size() * sizeof(Code));
  storage.resize(tuples * maps.maps.size() * sizeof(Code));
  const std::span codes(reinterpret_cast<Code*>(storage.data()), tuples * maps.maps.size());
  const std::vector<uint32_t> face_of = faces_of_half_edges(*elements.surface, array.domain);
  RansDecoder decoder(bytes, 1);
  std::vector<uint32_t> tuple_of;
  code_array<RansDecoder, Code>(
      decoder, elements, face_of, array, tuples, maps, coding, codes.first(codes.size()),
      [&] { return !decoder.exhausted() && (!pace || pace->step()); }, &tuple_of);
  if (pace && pace->stopped()) return cancelled();
  if (decoder.exhausted())
    return failure(ErrorCode::corrupt, "array \"" + array.name + "\": its stream ends early");
  if (maps.octahedral) {
    store_vectors<Code>(array, *maps.octahedral, codes.first(tuples * maps.maps.size()));
  } else if (array.domain == Domain::corner) {
    store_distinct<Code>(array, maps.maps, tuple_of, codes);
  } else {
    storage.resize(tuples * maps.maps.size() * sizeof(Code));
    MAILLE_CHECK(store_numbers<Code>(array, maps.maps, std::move(storage)));
  }
  return read_exceptions(exceptions, ElementWalk(elements, face_of), tuples, array);
}

/// No value for one that is unknown, or that the array cannot have.
std::optional<ArrayCoding> read_coding(ByteReader& in, const PatchElements& elements, const Array& array,
                                       uint8_t kind, uint8_t flags) {
  ArrayCoding coding;
  if (kind == normal_coding) {
    const auto weight = in.get<uint8_t>();
    const auto how = in.get<uint8_t>();
    if (weight > NormalCoding::own || how > NormalCoding::most_flags || (flags & ~4u) != 0 ||
        !is_normal(elements, array)) {
      return std::nullopt;
    }
    coding.normal = NormalCoding::from(weight, how);
    // Codes on the octahedron are predicted by a direction, which only vectors of length 1 always have.
    if ((flags & 4) != 0 && !coding.normal->unit) return std::nullopt;
    return coding;
  }
  if (kind == facet_coding) {
    coding.facet = read_facet_coding(in);
    if (!coding.facet || flags != 0 || !is_normal(elements, array) || array.domain != Domain::cell)
      return std::nullopt;
    return coding;
  }
  return std::nullopt;
}

}  // namespace

bool is_normal(const PatchElements& elements, const Array& array) {
  return !elements.positions.empty() && array.role == Role::normal && array.components == 3 &&
         is_float(array.type) && array.domain != Domain::mesh;
}

std::vector<std::byte> encode_normals(const PatchElements& elements, const Array& array,
                                      const ArrayMaps& maps, std::span<const uint32_t> source, Pace* pace) {
  if (size_of(array.type) == 8) return encode_as<int64_t>(elements, array, maps, source, pace);
  return encode_as<int32_t>(elements, array, maps, source, pace);
}

Result<> decode_normals(const PatchElements& elements, Bytes bytes, Array& array, Pace* pace) {
  ByteReader in(bytes);
  const auto kind = in.get<uint8_t>();
  const auto flags = in.get<uint8_t>();
  const auto coding = read_coding(in, elements, array, kind, flags);
  if (!in.ok() || !coding)
    return failure(ErrorCode::corrupt, "array \"" + array.name + "\" is coded in an unknown way");
  const ArrayMaps maps = MAILLE_TRY(read_maps(in, array, (flags & 4) != 0));
  const Bytes exceptions = in.get_bytes(in.get_count());
  const Bytes coded = in.get_bytes(in.remaining());
  if (!in.ok()) return failure(ErrorCode::corrupt, "array \"" + array.name + "\": its stream is too short");
  const uint64_t tuples = elements.count(array.domain);
  if (size_of(array.type) == 8)
    return decode_as<int64_t>(elements, *coding, maps, coded, exceptions, tuples, array, pace);
  return decode_as<int32_t>(elements, *coding, maps, coded, exceptions, tuples, array, pace);
}

}  // namespace maille
