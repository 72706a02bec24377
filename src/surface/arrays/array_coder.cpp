#include "surface/arrays/array_coder.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include "base/bytes.h"
#include "base/pages.h"
#include "base/result.h"
#include "entropy/rans.h"
#include "numbers/number_maps.h"
#include "numbers/refined_numbers.h"
#include "surface/arrays/array_around.h"
#include "surface/arrays/joints.h"
#include "surface/arrays/normal_arrays.h"
#include "surface/arrays/octahedral_tuples.h"
#include "surface/fans/positions.h"
#include "surface/front/mixed_array.h"
#include "surface/patch_topology.h"

namespace maille {
namespace {

// The first byte of a stream of numbers by what is around their elements.
constexpr uint8_t around_coding = 17;
constexpr uint8_t octahedral_flag = 1;
// The coder of tuples takes up to four components, as many as a processor's register has floats. Arrays of
// more are coded in parts, which know nothing of each other.
constexpr uint32_t most_components = 4;

tl::unexpected<Error> corrupt(const Array& array, const char* what) {
  return failure(ErrorCode::corrupt, "array \"" + array.name + "\"" + what);
}

/// The elements of an array: what is around them, and where they are.
struct Elements {
  const FanSurface* around = nullptr;
  std::vector<uint32_t> point_of;  ///< by element of a corner array
  uint32_t count = 0;
  std::span<const Vector3> positions;

  ElementPlaces places() const { return {positions, point_of}; }
};

/// Arrays of corners have an element for each set of joined corners, numbered by the first corner of each.
/// `of_corner` comes with the first corner of each corner's set, which is never higher than the corner, and
/// becomes the number of its element.
struct CornerElements {
  std::vector<uint32_t> of_corner;
  std::vector<uint32_t> first;  ///< corner, by element

  explicit CornerElements(std::vector<uint32_t> first_of_corner) : of_corner(std::move(first_of_corner)) {
    for (uint32_t c = 0; c < of_corner.size(); ++c) {
      uint32_t& element = of_corner[c];
      if (element != c) {
        element = of_corner[element];
        continue;
      }
      element = static_cast<uint32_t>(first.size());
      first.push_back(c);
    }
  }
};

/// Twins are by corner of PatchElements, joints are by corner of CornerFaces.
std::vector<uint32_t> twins_of_corners(const PatchElements& elements, const CornerFaces& faces) {
  std::vector<uint32_t> twins(elements.twins.empty() ? 0 : faces.corners());
  for (uint32_t c = 0; c < twins.size(); ++c) twins[c] = elements.twins[faces.number_of(c)];
  return twins;
}

/// Do two tuples come back as the same? With loss tuples that have the same codes do, so that corners of one
/// wedge may differ a little in the source. Exceptions come back bit for bit, so they are the same only as
/// bytes.
class SameTuples {
 public:
  SameTuples(const Array& array, const ArrayMaps& maps) : array_(array), maps_(maps) {}
  bool operator()(uint64_t a, uint64_t b) const {
    if (a == b) return true;
    const size_t size = array_.tuple_size();
    const std::byte *x = array_.bytes.data() + a * size, *y = array_.bytes.data() + b * size;
    if (std::memcmp(x, y, size) == 0) return true;
    if (maps_.lossless || is_exception(a) || is_exception(b)) return false;
    if (maps_.octahedral)
      return codes_of_tuple(*maps_.octahedral, array_.type, x) ==
             codes_of_tuple(*maps_.octahedral, array_.type, y);
    for (uint32_t k = 0; k < array_.components; ++k) {
      const size_t at = k * size_of(array_.type);
      if (maps_.maps[k].code_of(array_.type, x + at) != maps_.maps[k].code_of(array_.type, y + at))
        return false;
    }
    return true;
  }

 private:
  bool is_exception(uint64_t tuple) const {
    const auto at =
        std::lower_bound(maps_.exceptions.begin(), maps_.exceptions.end(), tuple * array_.components);
    return at != maps_.exceptions.end() && *at < (tuple + 1) * array_.components;
  }

  const Array& array_;
  const ArrayMaps& maps_;
};

/// Unit vectors are two whole numbers each, on the square of the octahedron, and are coded as an array of
/// these.
Array pairs_of_vectors(const Array& array, const ArrayMaps& maps) {
  Array pairs = make_array(array.name, array.domain, Scalar::i32, 2, Role::none);
  pairs.bytes.resize(array.count() * pairs.tuple_size());
  for (uint64_t i = 0; i < array.count(); ++i) {
    // Vectors that are none (exceptions) have no codes: any will do.
    if (std::binary_search(maps.exceptions.begin(), maps.exceptions.end(), 3 * i)) continue;
    const auto codes =
        codes_of_tuple(*maps.octahedral, array.type, array.bytes.data() + i * array.tuple_size());
    std::memcpy(pairs.bytes.data() + i * sizeof codes, codes.data(), sizeof codes);
  }
  return pairs;
}
void store_vectors(const Array& pairs, const OctahedralMap& map, Array& array) {
  array.bytes.resize(pairs.count() * array.tuple_size());
  for (uint64_t i = 0; i < pairs.count(); ++i) {
    std::array<int32_t, 2> codes;
    std::memcpy(codes.data(), pairs.bytes.data() + i * sizeof codes, sizeof codes);
    store_tuple(map, codes, array.type, array.bytes.data() + i * array.tuple_size());
  }
}

/// The components of an array that one coder takes, as an array of their own.
Array some_components(const Array& array, uint32_t first, uint32_t count) {
  Array part = make_array(array.name, array.domain, array.type, count, array.role);
  const size_t from = first * size_of(array.type), size = part.tuple_size();
  part.bytes.resize(array.count() * size);
  for (uint64_t i = 0; i < array.count(); ++i)
    std::memcpy(part.bytes.data() + i * size, array.bytes.data() + i * array.tuple_size() + from, size);
  return part;
}
/// Exceptions are places of numbers, which change with the number of components. They stay rising.
ArrayMaps some_maps(const ArrayMaps& maps, uint32_t components, uint32_t first, uint32_t count) {
  ArrayMaps part;
  part.lossless = maps.lossless;
  part.maps.assign(maps.maps.begin() + first, maps.maps.begin() + first + count);
  for (const uint64_t place : maps.exceptions) {
    const uint64_t k = place % components;
    if (k >= first && k < first + count) part.exceptions.push_back(place / components * count + k - first);
  }
  return part;
}
/// Puts the components of a part between those of others, which come before or after it.
void put_components(const Array& part, uint32_t first, Array& array) {
  const size_t from = first * size_of(array.type), size = part.tuple_size();
  array.bytes.resize(part.count() * array.tuple_size());
  for (uint64_t i = 0; i < part.count(); ++i)
    std::memcpy(array.bytes.data() + i * array.tuple_size() + from, part.bytes.data() + i * size, size);
}

/// The numbers of an array without a map of unit vectors. Parts have their sizes before them; a part that is
/// alone takes the rest of the stream.
void write_numbers(ByteWriter& out, const Elements& elements, const Array& array, const ArrayMaps& maps,
                   std::span<const uint32_t> source) {
  const auto write = [&](const Array& of, const ArrayMaps& with) {
    return encode_numbers(*elements.around, of, with, source, elements.places());
  };
  if (array.components <= most_components) return out.put_bytes(write(array, maps));
  for (uint32_t k = 0; k < array.components; k += most_components) {
    const uint32_t count = std::min(array.components - k, most_components);
    const auto bytes = write(some_components(array, k, count), some_maps(maps, array.components, k, count));
    out.put_count(bytes.size());
    out.put_bytes(bytes);
  }
}
/// Each part fills all elements, so that its components can be put between the others at once.
Result<> read_numbers(ByteReader& in, FanDecoder& around, const ElementPlaces& places, uint32_t count,
                      Array& array) {
  if (array.components <= most_components)
    return decode_numbers(around, in.get_bytes(in.remaining()), places, count, array);
  for (uint32_t k = 0; k < array.components; k += most_components) {
    Array part = make_array(array.name, array.domain, array.type,
                            std::min(array.components - k, most_components), array.role);
    const Bytes bytes = in.get_bytes(in.get_count());
    if (!in.ok()) return corrupt(array, ": its stream is too short");
    MAILLE_CHECK(decode_numbers(around, bytes, places, count, part));
    put_components(part, k, array);
  }
  if (in.remaining() > 0) return corrupt(array, " has something behind its numbers");
  return {};
}

/// The numbers of an array, of whatever map.
void write_tuples(ByteWriter& out, const Elements& elements, const Array& array, const ArrayMaps& maps,
                  std::span<const uint32_t> source) {
  if (!maps.octahedral) return write_numbers(out, elements, array, maps, source);
  out.put_count(static_cast<uint64_t>(maps.octahedral->steps));
  const std::vector<std::byte> exceptions = write_exceptions(array, maps.exceptions, source);
  out.put_count(exceptions.size());
  out.put_bytes(exceptions);
  ArrayMaps of_pairs;
  of_pairs.maps.resize(2);
  write_numbers(out, elements, pairs_of_vectors(array, maps), of_pairs, source);
}
Result<> read_tuples(ByteReader& in, FanDecoder& around, const ElementPlaces& places, uint32_t count,
                     bool octahedral, Array& array) {
  if (!octahedral) return read_numbers(in, around, places, count, array);
  const uint64_t steps = in.get_count();
  const Bytes exceptions = in.get_bytes(in.get_count());
  // What vector_of() relies on is checked here.
  if (!in.ok() || steps == 0 || steps > most_octahedral_steps || array.components != 3 ||
      !is_float(array.type))
    return corrupt(array, " has an impossible map of unit vectors");
  Array pairs = make_array(array.name, array.domain, Scalar::i32, 2, Role::none);
  MAILLE_CHECK(read_numbers(in, around, places, count, pairs));
  store_vectors(pairs, OctahedralMap{static_cast<int32_t>(steps)}, array);
  return read_exceptions(exceptions, array);
}

/// Codes an array over what is around its elements. Elements beyond those that have something around them
/// follow: points of loose cells, these cells, their corners, each predicted from the one before.
/// docs/format.md, 13.2.
std::vector<std::byte> encode_around(const PatchElements& elements, ArrayAround& around, const Array& array,
                                     const ArrayMaps& maps, std::span<const uint32_t> source) {
  ByteWriter out;
  out.put(around_coding);
  out.put(maps.octahedral ? octahedral_flag : uint8_t{0});
  Elements of;
  of.positions = elements.positions;
  if (array.domain == Domain::point) {
    const FanDecoder& points = around.points();
    of.around = &points.complete();
    write_tuples(out, of, array, maps, source);
    return out.take();
  }
  of.positions = {};
  FanSurface references;
  of.around = &references;
  if (array.domain == Domain::cell) of.around = &around.cells().complete();
  if (array.domain != Domain::corner) {
    write_tuples(out, of, array, maps, source);
    return out.take();
  }
  const CornerFaces& faces = around.numbered_faces();
  const std::vector<uint32_t> twins = twins_of_corners(elements, faces);
  const SameTuples same(array, maps);
  const auto tuple = [&](uint32_t corner) { return source[faces.number_of(corner)]; };
  RansEncoder coder(1);
  CornerElements corners(JointCoder<RansEncoder>(coder, faces, around.points().complete(), twins)
                             .code([&](uint32_t a, uint32_t b) { return same(tuple(a), tuple(b)); }));
  // First which corners are joined, as everything else is about sets of them.
  const std::vector<std::byte> joints = coder.finish();
  out.put_count(joints.size());
  out.put_bytes(joints);
  std::vector<uint32_t> tuples;
  for (const uint32_t corner : corners.first) {
    tuples.push_back(tuple(corner));
    of.point_of.push_back(faces.points[corner]);
  }
  references = element_references(faces, corners.of_corner, static_cast<uint32_t>(tuples.size()));
  // Corners of loose cells come last in PatchElements, and are elements of their own.
  tuples.insert(tuples.end(), source.end() - elements.loose_corners, source.end());
  of.point_of.resize(tuples.size());
  of.positions = elements.positions;
  write_tuples(out, of, array, maps, tuples);
  return out.take();
}

/// From elements to corners. `size`: of a tuple, as a constant where that is common, so that copies are a
/// load and a store.
template <class Size>
void spread_bytes(const CornerFaces& faces, const CornerElements& corners, const std::byte* from,
                  std::byte* to, Size size) {
  for (uint32_t c = 0; c < faces.corners(); ++c)
    std::memcpy(to + size_t{faces.number_of(c)} * size, from + size_t{corners.of_corner[c]} * size, size);
}
void spread_tuples(const PatchElements& elements, const CornerFaces& faces, const CornerElements& corners,
                   Array& array) {
  const size_t size = array.tuple_size(), loose = elements.loose_corners * size;
  // Gaps (corners of border triangles) stay zero.
  std::vector<std::byte> spread(elements.corners() * size);
  const std::byte* const from = array.bytes.data();
  if (size == 8) {
    spread_bytes(faces, corners, from, spread.data(), std::integral_constant<size_t, 8>{});
  } else if (size == 12) {
    spread_bytes(faces, corners, from, spread.data(), std::integral_constant<size_t, 12>{});
  } else {
    spread_bytes(faces, corners, from, spread.data(), size);
  }
  std::copy_n(from + array.bytes.size() - loose, loose, spread.data() + spread.size() - loose);
  array.bytes = std::move(spread);
}

Result<> decode_around(const PatchElements& elements, ArrayAround& around, ByteReader& in,
                       uint64_t mesh_tuples, Array& array) {
  const auto flags = in.get<uint8_t>();
  // A flag that is not known is another format; nothing behind it can be read.
  if (!in.ok() || flags > octahedral_flag) return corrupt(array, " is coded in an unknown way");
  const bool octahedral = flags == octahedral_flag;
  if (array.domain == Domain::point)
    return read_tuples(in, around.points(), {elements.positions, {}}, elements.points, octahedral, array);
  if (array.domain == Domain::cell)
    return read_tuples(in, around.cells(), {}, elements.cells(), octahedral, array);
  if (array.domain == Domain::mesh) {
    // A description holds counts of 64 bits; elements have 32.
    if (mesh_tuples > UINT32_MAX) return corrupt(array, " has too many tuples");
    FanDecoder nothing = FanDecoder::over(FanSurface());
    return read_tuples(in, nothing, {}, static_cast<uint32_t>(mesh_tuples), octahedral, array);
  }
  const CornerFaces& faces = around.numbered_faces();
  const std::vector<uint32_t> twins = twins_of_corners(elements, faces);
  const Bytes joints = in.get_bytes(in.get_count());
  if (!in.ok()) return corrupt(array, ": its stream is too short");
  RansDecoder coder(joints, 1);
  const CornerElements corners(
      JointCoder<RansDecoder>(coder, faces, around.points().complete(), twins).code([](uint32_t, uint32_t) {
        return false;
      }));
  if (coder.exhausted()) return corrupt(array, ": its joints end early");
  std::vector<uint32_t> point_of;
  for (const uint32_t corner : corners.first) point_of.push_back(faces.points[corner]);
  const auto count = static_cast<uint32_t>(point_of.size());
  FanDecoder references = FanDecoder::over(element_references(faces, corners.of_corner, count));
  // (Places of loose corners are not used: nothing is around them, so nothing is placed.)
  point_of.resize(size_t{count} + elements.loose_corners);
  MAILLE_CHECK(read_tuples(in, references, {elements.positions, point_of}, count + elements.loose_corners,
                           octahedral, array));
  spread_tuples(elements, faces, corners, array);
  return {};
}

/// Three numbers for each point are predicted as a place in space. Callers ask for mixing of positions only
/// (5582ff6).
bool is_mixable(const Array& array, const ArrayMaps& maps) {
  return array.domain == Domain::point && maps.maps.size() == 3 && !maps.octahedral;
}

// Behind the maps stand details (RefinedMaps).
constexpr uint8_t refined_flag = 32;

/// Positions mixed, as POSI 0 with coding 16: maps, details of refined doubles, exceptions, then what
/// encode_mixed() writes. No value where the steps of the maps are not for geometry.
template <class Code>
std::optional<std::vector<std::byte>> encode_with_mixing(const PatchElements& elements, const Array& array,
                                                         const ArrayMaps& maps,
                                                         std::span<const uint32_t> source, Pace* pace) {
  RefinedMaps refined;
  refined.coarse = maps.maps;
  if (maps.lossless) refined = refine_maps(array, maps.maps, source);
  const size_t size = size_of(array.type);
  std::vector<Code> codes(source.size() * 3);
  for (size_t i = 0; i < codes.size(); ++i)
    codes[i] = static_cast<Code>(refined.coarse[i % 3].code_of(
        array.type, array.bytes.data() + (size_t{source[i / 3]} * 3 + i % 3) * size));
  if (!can_mix<Code>(array.type, refined.coarse, codes)) return std::nullopt;
  ByteWriter out;
  out.put(mixed_coding);
  out.put(refined.any() ? refined_flag : uint8_t{0});
  for (const NumberMap& map : refined.coarse) write_map(out, map);
  if (refined.any()) {
    write_exact_maps(out, refined);
    put_section(out, encode_details(refined, array, source));
  }
  const std::vector<std::byte> exceptions = write_exceptions(array, maps.exceptions, source);
  out.put_count(exceptions.size());
  out.put_bytes(exceptions);
  out.put_bytes(encode_mixed<Code>(elements, array.type, refined.coarse, codes, pace));
  return out.take();
}

template <class Code>
Result<> decode_with_mixing(const PatchElements& elements, std::span<const NumberMap> maps,
                            const RefinedMaps* refined, Bytes details, Bytes bytes, Array& array,
                            Pace* pace) {
  // A tuple is at least one decision, and a bit holds at most 2^11 of them: a larger claim cannot be true.
  if (elements.points / 16384 > bytes.size() + 16)
    return corrupt(array, " has more tuples than its stream can hold");
  std::vector<std::byte> storage;
  const size_t count = size_t{3} * elements.points;
  reserve_pages(storage, count * sizeof(Code));
  storage.resize(count * sizeof(Code));
  // Numbers of the same size are made in place of their codes, so that no second array is needed.
  const std::span codes(reinterpret_cast<Code*>(storage.data()), count);
  MAILLE_CHECK(decode_mixed<Code>(elements, array.type, maps, bytes, codes, pace));
  if constexpr (sizeof(Code) == 8) {
    if (refined != nullptr) MAILLE_CHECK(store_refined(*refined, details, codes));
  }
  const size_t size = size_of(array.type);
  std::vector<std::byte> separate(size == sizeof(Code) ? 0 : count * size);
  std::byte* const out = separate.empty() ? storage.data() : separate.data();
  for (size_t k = 0; k < 3 && count > 0; ++k) {
    if (refined != nullptr && refined->refined[k]) continue;
    maps[k].store_numbers(array.type, storage.data() + k * sizeof(Code), out + k * size, 3, elements.points);
  }
  array.bytes = separate.empty() ? std::move(storage) : std::move(separate);
  return {};
}

Result<> decode_mixed_array(const PatchElements& elements, ByteReader& in, Array& array, Pace* pace) {
  const auto flags = in.get<uint8_t>();
  if (!in.ok() || array.domain != Domain::point || array.components != 3 ||
      (flags != 0 && (flags != refined_flag || array.type != Scalar::f64)))
    return corrupt(array, " is coded in an unknown way");
  std::vector<NumberMap> maps;
  for (unsigned k = 0; k < 3; ++k) maps.push_back(MAILLE_TRY(read_map(in, array.type)));
  std::optional<RefinedMaps> refined;
  Bytes details;
  if (flags == refined_flag) {
    refined = MAILLE_TRY(read_exact_maps(in, maps));
    details = in.get_bytes(in.get_count());
  }
  const Bytes exceptions = in.get_bytes(in.get_count());
  const Bytes coded = in.get_bytes(in.remaining());
  if (!in.ok()) return corrupt(array, ": its stream is too short");
  if (size_of(array.type) == 8) {
    MAILLE_CHECK(decode_with_mixing<int64_t>(elements, maps, refined ? &*refined : nullptr, details, coded,
                                             array, pace));
  } else {
    MAILLE_CHECK(decode_with_mixing<int32_t>(elements, maps, nullptr, {}, coded, array, pace));
  }
  return read_exceptions(exceptions, array);
}

/// Normals that take more bits each are not those of the surface, so coding them as numbers is tried, too.
/// Chosen, not swept: it only saves a trial where normals follow from the surface, which take far less.
constexpr size_t most_bits_of_normals = 16;

/// Facets' normals that a formula gives take hardly a bit without loss, but some on a lattice: the smaller
/// counts, as what is exact keeps every bound.
std::vector<std::byte> encode_smaller_normals(const PatchElements& elements, const Array& array,
                                              const ArrayMaps& maps, std::span<const uint32_t> source,
                                              Pace* pace) {
  std::vector<std::byte> best = encode_normals(elements, array, maps, source, pace);
  if (maps.lossless || array.domain != Domain::cell) return best;
  const auto exact = choose_maps(array, {}, false);
  if (!exact) return best;
  std::vector<std::byte> other = encode_normals(elements, array, *exact, source, nullptr);
  return other.size() < best.size() ? other : best;
}

}  // namespace

/// Without half-edges corners are those of the fans, which have no gaps.
uint32_t PatchElements::corners() const {
  const uint32_t of_faces = surface->half_edges.size();
  return (of_faces == 0 && fans != nullptr ? static_cast<uint32_t>(fans->corners.size()) : of_faces) +
         loose_corners;
}

uint32_t PatchElements::count(Domain domain) const {
  switch (domain) {
    case Domain::point:
      return points;
    case Domain::cell:
      return cells();
    case Domain::corner:
      return corners();
    case Domain::mesh:
      break;
  }
  return 0;
}

/// Fans have their faces already; after the front they come from half-edges.
const CornerFaces& ArrayAround::faces() {
  if (!faces_)
    faces_ = elements_.fans != nullptr ? corner_faces(*elements_.fans) : corner_faces(*elements_.surface);
  return *faces_;
}

const CornerFaces& ArrayAround::numbered_faces() {
  faces();
  const bool flipped = elements_.flipped != nullptr && !elements_.flipped->empty();
  if (flipped && faces_->number.empty()) faces_->flip(*elements_.flipped);
  return *faces_;
}

FanDecoder& ArrayAround::points() {
  if (!points_) points_ = FanDecoder::over(element_references(faces(), faces().points, faces().point_count));
  return *points_;
}

FanDecoder& ArrayAround::cells() {
  if (!cells_) cells_ = FanDecoder::over(face_references(faces()));
  return *cells_;
}

/// Ways are tried in this order: mixing where it is wanted and can be done, normals by the surface, numbers
/// by what is around.
std::vector<std::byte> encode_array(const PatchElements& elements, const Array& array, const ArrayMaps& maps,
                                    std::span<const uint32_t> source, bool mixed, Pace* pace) {
  if (mixed && is_mixable(array, maps)) {
    auto bytes = size_of(array.type) == 8 ? encode_with_mixing<int64_t>(elements, array, maps, source, pace)
                                          : encode_with_mixing<int32_t>(elements, array, maps, source, pace);
    if (bytes) return std::move(*bytes);
  }
  std::vector<std::byte> best;
  if (is_normal(elements, array)) {
    best = encode_smaller_normals(elements, array, maps, source, pace);
    if (8 * best.size() < most_bits_of_normals * source.size()) return best;
  }
  ArrayAround alone(elements);
  std::vector<std::byte> numbers =
      encode_around(elements, elements.around != nullptr ? *elements.around : alone, array, maps, source);
  return best.empty() || numbers.size() < best.size() ? numbers : best;
}

Result<> decode_array(const PatchElements& elements, Bytes bytes, uint64_t mesh_tuples, Array& array,
                      Pace* pace) {
  ByteReader in(bytes);
  const auto kind = in.get<uint8_t>();
  if (kind == normal_coding || kind == facet_coding) return decode_normals(elements, bytes, array, pace);
  if (kind == mixed_coding) return decode_mixed_array(elements, in, array, pace);
  if (!in.ok() || kind != around_coding) return corrupt(array, " is coded in an unknown way");
  ArrayAround alone(elements);
  return decode_around(elements, elements.around != nullptr ? *elements.around : alone, in, mesh_tuples,
                       array);
}

}  // namespace maille
