#include "surface/array_coder.h"

#include <algorithm>
#include <string>

#include "base/bytes.h"
#include "base/pages.h"
#include "base/result.h"
#include "entropy/rans.h"
#include "surface/mixed_array.h"
#include "surface/number_maps.h"
#include "surface/tuple_coder.h"

namespace maille {
namespace {

// Elements a coding is tried on: enough to fill the models, few enough to try several.
constexpr uint32_t trial_elements = 1 << 15;

/// Visits the elements of a domain in coded order with their stencils: what both directions share. `visit`
/// returns false to stop.
class ElementWalk {
 public:
  ElementWalk(const PatchElements& elements, const std::vector<uint32_t>& face_of)
      : elements_(elements), surface_(*elements.surface), face_of_(face_of) {}

  template <class Visit>
  void run(Domain domain, uint64_t mesh_tuples, Visit visit) {
    switch (domain) {
      case Domain::point:
        return points(visit);
      case Domain::cell:
        return cells(visit);
      case Domain::corner:
        return corners(visit);
      case Domain::mesh:
        return rest(0, static_cast<uint32_t>(mesh_tuples), visit);
    }
  }

 private:
  /// Elements that are not on the surface have no neighbours.
  template <class Visit>
  void rest(uint32_t from, uint32_t to, Visit visit) {
    const Stencil nothing{};
    for (uint32_t i = from; i < to; ++i) {
      if (!visit(i, nothing)) return;
    }
  }

  template <class Visit>
  void points(Visit visit) {
    uint32_t next = 0;
    for (uint32_t vertex = 0; vertex < surface_.vertices.size(); ++vertex) {
      if (surface_.point(vertex) != next) continue;  // another fan of a point before
      find_point_stencil(surface_, vertex, stencil_);
      if (!visit(next++, stencil_)) return;
    }
    rest(surface_.point_count, elements_.points, visit);
  }

  template <class Visit>
  void cells(Visit visit) {
    const uint32_t faces = surface_.face_count;
    for (uint32_t face = 0; face < faces; ++face) {
      stencil_.gate_count = 0;
      stencil_.neighbour = none;
      uint32_t h = surface_.face(face);
      do {
        const uint32_t other = face_of_[surface_.half_edges.opposite[h]];
        if (other < face && (stencil_.neighbour == none || other > stencil_.neighbour))
          stencil_.neighbour = other;
        h = surface_.half_edges.next(h);
      } while (h != surface_.face(face));
      if (!visit(face, stencil_)) return;
    }
    rest(faces, elements_.cells(), visit);
  }

  bool is_real(uint32_t h) const { return face_of_[h] != none; }

  /// The corner at half-edge h when its vertex came before `vertex`; none otherwise.
  uint32_t known_corner(uint32_t h, uint32_t vertex) const {
    return is_real(h) && surface_.half_edges.origin[h] < vertex ? h : none;
  }

  void find_corner_stencil(uint32_t h, uint32_t vertex, uint32_t neighbour) {
    const HalfEdges& edges = surface_.half_edges;
    stencil_.gate_count = 0;
    const uint32_t next = edges.next(h);
    const uint32_t a = known_corner(next, vertex);
    const uint32_t b = known_corner(edges.previous(h), vertex);
    stencil_.neighbour = neighbour != none ? neighbour : a != none ? a : b;
    if (a == none || b == none) return;
    const bool triangle = edges.next(edges.next(next)) == h;
    const uint32_t across =
        known_corner(triangle ? edges.previous(edges.opposite[next]) : edges.next(next), vertex);
    if (across == none) return;
    stencil_.gates[0] = {a, b, across};
    stencil_.gate_count = 1;
  }

  template <class Visit>
  void corners(Visit visit) {
    for (uint32_t vertex = 0; vertex < surface_.vertices.size(); ++vertex) {
      uint32_t neighbour = none;
      const uint32_t first = surface_.vertices.corner[vertex];
      uint32_t h = first;
      do {
        if (is_real(h)) {
          find_corner_stencil(h, vertex, neighbour);
          if (!visit(h, stencil_)) return;
          neighbour = h;
        }
        h = surface_.half_edges.turn(h);
      } while (h != first);
    }
    rest(surface_.half_edges.size(), elements_.corners(), visit);
  }

  const PatchElements& elements_;
  const PatchSurface& surface_;
  const std::vector<uint32_t>& face_of_;
  Stencil stencil_;
};

/// Number of the real face of each half-edge; none in border triangles. Points do without.
std::vector<uint32_t> faces_of_half_edges(const PatchSurface& surface, Domain domain) {
  std::vector<uint32_t> face_of;
  if (domain != Domain::cell && domain != Domain::corner) return face_of;
  face_of.assign(surface.half_edges.size(), none);
  for (uint32_t face = 0; face < surface.face_count; ++face) {
    uint32_t h = surface.face(face);
    do {
      face_of[h] = face;
      h = surface.half_edges.next(h);
    } while (h != surface.face(face));
  }
  return face_of;
}

unsigned lanes_for(size_t components) {
  return components == 3 ? 3 : 1;
}

/// Calls `with` with the number of components as a constant where that pays, else with 0.
template <class Function>
void with_components(size_t components, Function with) {
  if (components == 3) return with(std::integral_constant<unsigned, 3>{});
  return with(std::integral_constant<unsigned, 0>{});
}

/// Room for the codes of so many tuples, with the one more that TupleCoder wants.
size_t codes_of(size_t tuples, const ArrayMaps& maps) {
  return tuples * maps.maps.size() + 1;
}

template <class Code>
std::vector<std::byte> encode_codes(const PatchElements& elements, const std::vector<uint32_t>& face_of,
                                    const Array& array, const ArrayMaps& maps, const TupleCoding& coding,
                                    std::span<Code> codes, uint32_t most, Pace* pace) {
  RansEncoder encoder(lanes_for(maps.maps.size()));
  ElementWalk walk(elements, face_of);
  with_components(maps.maps.size(), [&](auto fixed) {
    TupleCoder<RansEncoder, Code, fixed> coder(encoder, coding, array.type, maps.maps, codes);
    walk.run(array.domain, array.count(), [&](uint32_t element, const Stencil& stencil) {
      if (most-- == 0) return false;
      coder.code(element, stencil);
      return !pace || pace->step();
    });
  });
  return encoder.finish();
}

/// The coding whose trial is smallest.
template <class Code>
TupleCoding choose_coding(const PatchElements& elements, const std::vector<uint32_t>& face_of,
                          const Array& array, const ArrayMaps& maps, std::span<Code> codes) {
  TupleCoding best;
  size_t smallest = SIZE_MAX;
  const auto consider = [&](const TupleCoding& coding) {
    size_t size =
        encode_codes<Code>(elements, face_of, array, maps, coding, codes, trial_elements, nullptr).size();
    // Whole values take time to decode; they must be worth it.
    if (coding.whole_values) size += size / 200;
    if (size >= smallest) return;
    smallest = size;
    best = coding;
  };
  const bool gates = array.domain == Domain::point || array.domain == Domain::corner;
  for (unsigned p = 0; p < predictor_count; ++p) {
    const auto predictor = static_cast<Predictor>(p);
    if (predictor >= Predictor::nearest_gate && !gates) continue;
    for (const bool whole_values : {false, true}) {
      consider({predictor, whole_values, array.domain != Domain::point});
    }
  }
  TupleCoding other = best;
  other.repeats = !best.repeats;
  consider(other);
  return best;
}

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

/// The place of a number in coded order, which is the only one that both sides share for every domain.
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
  const auto find = [&](uint32_t element, const Stencil&) {
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
  const auto take = [&](uint32_t element, const Stencil&) {
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
    std::array<double, 3> vector;
    for (size_t k = 0; k < 3; ++k) vector[k] = number_as_double(array.type, numbers + k * number_bytes);
    // Vectors that are none (exceptions) have no codes: any will do.
    const bool exception = std::binary_search(maps.exceptions.begin(), maps.exceptions.end(), 3 * tuple);
    const auto pair = exception ? std::array<int32_t, 2>{} : maps.octahedral->codes_of(vector);
    codes[0] = pair[0];
    codes[1] = pair[1];
    return;
  }
  for (size_t k = 0; k < maps.maps.size(); ++k) {
    codes[k] = static_cast<Code>(maps.maps[k].code_of(array.type, numbers + k * number_bytes));
  }
}

void put_exceptions(ByteWriter& out, const PatchElements& elements, const std::vector<uint32_t>& face_of,
                    const Array& array, const ArrayMaps& maps, std::span<const uint32_t> source) {
  ByteWriter exceptions;
  write_exceptions(exceptions, array, maps, ElementWalk(elements, face_of),
                   [&](uint32_t element) { return uint64_t{source[element]}; });
  out.put_count(exceptions.size());
  out.put_bytes(exceptions.bytes());
}

/// Three numbers for each point are predicted as a place in space.
bool is_mixable(const Array& array, const ArrayMaps& maps) {
  return array.domain == Domain::point && maps.maps.size() == 3;
}

template <class Code>
std::vector<std::byte> encode_as(const PatchElements& elements, const Array& array, const ArrayMaps& maps,
                                 std::span<const uint32_t> source, bool mixed, int effort, Pace* pace) {
  std::vector<Code> codes(codes_of(source.size(), maps));
  for (size_t i = 0; i < source.size(); ++i) {
    if (source[i] != none) fill_codes(array, maps, source[i], codes.data() + i * maps.maps.size());
  }
  const std::vector<uint32_t> face_of = faces_of_half_edges(*elements.surface, array.domain);
  if (mixed && can_mix<Code>(array.type, maps.maps, std::span(codes).first(codes.size() - 1))) {
    ByteWriter out;
    out.put(mixed_coding);
    out.put(uint8_t{0});
    for (const NumberMap& map : maps.maps) write_map(out, map);
    put_exceptions(out, elements, face_of, array, maps, source);
    out.put_bytes(encode_mixed<Code>(elements, array.type, maps.maps,
                                     std::span(codes).first(codes.size() - 1), effort, pace));
    return out.take();
  }
  const TupleCoding coding = choose_coding<Code>(elements, face_of, array, maps, codes);
  ByteWriter out;
  out.put(coding.predictor);
  out.put(static_cast<uint8_t>(coding.whole_values | coding.repeats << 1 | maps.octahedral.has_value() << 2));
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
void store_numbers(Array& array, std::span<const NumberMap> maps, std::vector<std::byte>&& codes) {
  const size_t number_bytes = size_of(array.type);
  const size_t count = codes.size() / sizeof(Code);
  std::vector<std::byte> separate;
  if (number_bytes != sizeof(Code)) separate.resize(count * number_bytes);
  std::byte* const out = separate.empty() ? codes.data() : separate.data();
  for (size_t k = 0; k < maps.size(); ++k) {
    maps[k].store_numbers(array.type, codes.data() + k * sizeof(Code), out + k * number_bytes, maps.size(),
                          count / maps.size());
  }
  array.bytes = number_bytes == sizeof(Code) ? std::move(codes) : std::move(separate);
}

/// The same for unit vectors, two codes each.
template <class Code>
void store_vectors(Array& array, const OctahedralMap& map, std::span<const Code> codes) {
  array.bytes.resize(codes.size() / 2 * array.tuple_size());
  for (size_t i = 0; i < codes.size() / 2; ++i) {
    const auto vector =
        map.vector_of({static_cast<int32_t>(codes[2 * i]), static_cast<int32_t>(codes[2 * i + 1])});
    std::byte* out = array.bytes.data() + i * array.tuple_size();
    for (size_t k = 0; k < 3; ++k) {
      if (array.type == Scalar::f32) {
        store(out + 4 * k, static_cast<float>(vector[k]));
      } else {
        store(out + 8 * k, vector[k]);
      }
    }
  }
}

template <class Code>
Result<> decode_as(const PatchElements& elements, bool mixed, const TupleCoding& coding,
                   const ArrayMaps& maps, Bytes bytes, Bytes exceptions, uint64_t tuples, Array& array,
                   Pace* pace) {
  // A tuple is at least one decision, and a bit holds at most 2^11 of them: a larger claim cannot be true.
  if (tuples / 16384 > bytes.size() + 16) {
    return failure(ErrorCode::corrupt,
                   "array \"" + array.name + "\" has more tuples than its stream can hold");
  }
  std::vector<std::byte> storage;
  reserve_pages(storage, codes_of(tuples, maps) * sizeof(Code));
  storage.resize(codes_of(tuples, maps) * sizeof(Code));
  const std::span codes(reinterpret_cast<Code*>(storage.data()), codes_of(tuples, maps));
  const std::vector<uint32_t> face_of = faces_of_half_edges(*elements.surface, array.domain);
  if (mixed) {
    MAILLE_CHECK(
        decode_mixed<Code>(elements, array.type, maps.maps, bytes, codes.first(codes.size() - 1), pace));
    storage.resize(storage.size() - sizeof(Code));
    store_numbers<Code>(array, maps.maps, std::move(storage));
    return read_exceptions(exceptions, ElementWalk(elements, face_of), tuples, array);
  }
  RansDecoder decoder(bytes, lanes_for(maps.maps.size()));
  ElementWalk walk(elements, face_of);
  with_components(maps.maps.size(), [&](auto fixed) {
    TupleCoder<RansDecoder, Code, fixed> coder(decoder, coding, array.type, maps.maps, codes);
    walk.run(array.domain, tuples, [&](uint32_t element, const Stencil& stencil) {
      coder.code(element, stencil);
      return !decoder.exhausted() && (!pace || pace->step());
    });
  });
  if (pace && pace->stopped()) return cancelled();
  if (decoder.exhausted())
    return failure(ErrorCode::corrupt, "array \"" + array.name + "\": its stream ends early");
  if (maps.octahedral) {
    store_vectors<Code>(array, *maps.octahedral, codes.first(tuples * maps.maps.size()));
  } else {
    storage.resize(tuples * maps.maps.size() * sizeof(Code));
    store_numbers<Code>(array, maps.maps, std::move(storage));
  }
  return read_exceptions(exceptions, ElementWalk(elements, face_of), tuples, array);
}

}  // namespace

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

std::vector<std::byte> encode_array(const PatchElements& elements, const Array& array, const ArrayMaps& maps,
                                    std::span<const uint32_t> source, int effort, Pace* pace) {
  const bool mixed = effort >= least_mixed_effort && is_mixable(array, maps);
  ArrayMaps used = maps;
  if (maps.lossless) used.maps = with_tables(array, maps.maps, source);
  if (size_of(array.type) == 8) return encode_as<int64_t>(elements, array, used, source, mixed, effort, pace);
  return encode_as<int32_t>(elements, array, used, source, mixed, effort, pace);
}

Result<> decode_array(const PatchElements& elements, Bytes bytes, uint64_t mesh_tuples, Array& array,
                      Pace* pace) {
  ByteReader in(bytes);
  TupleCoding coding;
  const auto kind = in.get<uint8_t>();
  const bool mixed = kind == mixed_coding && array.domain == Domain::point && array.components == 3;
  coding.predictor = mixed ? Predictor::previous : static_cast<Predictor>(kind);
  const auto flags = in.get<uint8_t>();
  coding.whole_values = (flags & 1) != 0;
  coding.repeats = (flags & 2) != 0;
  if (!in.ok() || static_cast<unsigned>(coding.predictor) >= predictor_count || flags > (mixed ? 0 : 7)) {
    return failure(ErrorCode::corrupt, "array \"" + array.name + "\" is coded in an unknown way");
  }
  const ArrayMaps maps = MAILLE_TRY(read_maps(in, array, (flags & 4) != 0));
  const Bytes exceptions = in.get_bytes(in.get_count());
  const Bytes coded = in.get_bytes(in.remaining());
  if (!in.ok()) return failure(ErrorCode::corrupt, "array \"" + array.name + "\": its stream is too short");
  const uint64_t tuples = array.domain == Domain::mesh ? mesh_tuples : elements.count(array.domain);
  if (size_of(array.type) == 8) {
    return decode_as<int64_t>(elements, mixed, coding, maps, coded, exceptions, tuples, array, pace);
  }
  return decode_as<int32_t>(elements, mixed, coding, maps, coded, exceptions, tuples, array, pace);
}

}  // namespace maille
