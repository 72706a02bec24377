#include "random/build/sampled_maps.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

#include "base/result.h"

namespace maille {
namespace {

constexpr uint64_t tuples_in_sample = 1 << 16;
constexpr uint64_t tuples_at_once = 1 << 14;
/// Tuples that join a sample at a time, and how often they may.
constexpr uint64_t most_misfits = 1 << 12;
constexpr unsigned most_rounds = 4;

/// Chooses the maps of an array that is read in parts. A sample proposes maps, and one pass over the array
/// tests them on every number; what they do not hold joins the sample. After four rounds that failed, maps
/// that hold anything are taken.
class ArraySampler {
 public:
  ArraySampler(MeshSource& mesh, size_t array, const Tolerance& tolerance)
      : mesh_(mesh),
        array_(array),
        tolerance_(tolerance),
        sample_(empty_array_of(mesh.description(), array)) {
    // Octahedral maps are made for normals that are all there.
    if (tolerance.kind != Tolerance::Kind::lossless) sample_.role = Role::none;
    count_ = sample_.domain == Domain::point ? mesh.description().points : mesh.description().cells;
  }

  Result<ArrayMaps> choose() {
    MAILLE_CHECK(take_sample());
    const bool lossy = tolerance_.kind != Tolerance::Kind::lossless;
    if (lossy) MAILLE_CHECK(add_extremes());
    for (unsigned round = 0; round < most_rounds; ++round) {
      ArrayMaps maps = MAILLE_TRY(choose_maps(sample_, tolerance_, array_ == positions_of_source));
      maps.exceptions.clear();
      if (maps.lossless && !is_float(sample_.type)) return maps;
      if (MAILLE_TRY(add_misfits(maps)) == 0) return maps;
    }
    // Codes that are the bits of the numbers hold every number, at the price of larger files.
    ArrayMaps any;
    any.maps.resize(sample_.components);
    if (is_float(sample_.type)) {
      for (NumberMap& map : any.maps) map.kind = NumberMap::Kind::ordered;
    }
    return any;
  }

 private:
  /// Calls visit(tuples) for pieces of the array, until it returns false.
  Result<> visit_all(const std::function<bool(Bytes)>& visit) {
    std::vector<std::byte> part(tuples_at_once * sample_.tuple_size());
    for (uint64_t first = 0; first < count_; first += tuples_at_once) {
      const uint64_t here = std::min(tuples_at_once, count_ - first);
      const auto tuples = std::span(part).first(here * sample_.tuple_size());
      MAILLE_CHECK(read_tuples_of(mesh_, array_, first, here, tuples));
      if (!visit(tuples)) return {};
    }
    return {};
  }
  /// Stretches, evenly over all of it.
  Result<> take_sample() {
    const size_t size = sample_.tuple_size();
    constexpr uint64_t at_once = 1 << 10;
    sample_.resize(std::min(count_, tuples_in_sample));
    if (count_ <= tuples_in_sample) return read_tuples_of(mesh_, array_, 0, count_, sample_.bytes);
    const uint64_t stretches = tuples_in_sample / at_once;
    for (uint64_t i = 0; i < stretches; ++i) {
      const uint64_t first = (count_ - at_once) / (stretches - 1) * i;
      const auto room = std::span(sample_.bytes).subspan(i * at_once * size, at_once * size);
      MAILLE_CHECK(read_tuples_of(mesh_, array_, first, at_once, room));
    }
    return {};
  }
  /// The least and the largest finite number of each component, as two tuples more: bounds depend on them.
  Result<> add_extremes() {
    const size_t number = size_of(sample_.type), size = sample_.tuple_size();
    std::vector<std::byte> low(size), high(size);
    std::vector<bool> any(sample_.components);
    MAILLE_CHECK(visit_all([&](Bytes tuples) {
      for (size_t i = 0; i < tuples.size() / number; ++i) {
        const size_t c = i % sample_.components;
        const std::byte* const from = tuples.data() + i * number;
        const double value = number_as_double(sample_.type, from);
        if (!std::isfinite(value)) continue;
        if (!any[c] || value < number_as_double(sample_.type, &low[c * number]))
          std::copy_n(from, number, &low[c * number]);
        if (!any[c] || value > number_as_double(sample_.type, &high[c * number]))
          std::copy_n(from, number, &high[c * number]);
        any[c] = true;
      }
      return true;
    }));
    sample_.bytes.insert(sample_.bytes.end(), low.begin(), low.end());
    sample_.bytes.insert(sample_.bytes.end(), high.begin(), high.end());
    return {};
  }
  /// Whether the maps that a sample suggests hold a number: its code fits the codec, and comes back within
  /// the bound, or bit for bit.
  bool fits(const ArrayMaps& maps, uint32_t component, const std::byte* number) const {
    const double value = number_as_double(sample_.type, number);
    if (!maps.lossless && !maps.maps[component].reaches(sample_.type, number)) return true;  // an exception
    const int64_t code = maps.maps[component].code_of(sample_.type, number);
    const int64_t most = size_of(sample_.type) == 8 ? int64_t{1} << 52 : 0x7fffffff;
    const bool any_code = maps.maps[component].kind == NumberMap::Kind::ordered;
    if (!any_code && (code >= most || code <= -most)) return false;
    std::byte back[8];
    maps.maps[component].store_number(sample_.type, code, back);
    if (maps.lossless) return std::memcmp(back, number, size_of(sample_.type)) == 0;
    return std::abs(number_as_double(sample_.type, back) - value) <= maps.bound;
  }
  /// Tuples that the maps do not hold join the sample. Returns how many.
  Result<uint64_t> add_misfits(const ArrayMaps& maps) {
    const size_t number = size_of(sample_.type), size = sample_.tuple_size();
    uint64_t found = 0;
    MAILLE_CHECK(visit_all([&](Bytes tuples) {
      for (size_t at = 0; at < tuples.size(); at += size) {
        bool all = true;
        for (uint32_t c = 0; c < sample_.components; ++c)
          all = all && fits(maps, c, tuples.data() + at + c * number);
        if (all) continue;
        ++found;
        sample_.bytes.insert(sample_.bytes.end(), tuples.data() + at, tuples.data() + at + size);
      }
      return found < most_misfits;
    }));
    return found;
  }

  MeshSource& mesh_;
  size_t array_;
  const Tolerance& tolerance_;
  Array sample_;
  uint64_t count_;
};

}  // namespace

Array empty_array_of(const MeshDescription& mesh, size_t array) {
  if (array != positions_of_source) return mesh.arrays[array];
  return make_array("position", Domain::point, mesh.point_type, 3);
}

Result<> read_tuples_of(MeshSource& mesh, size_t array, uint64_t first, uint64_t count,
                        std::span<std::byte> out) {
  return array == positions_of_source ? mesh.read_points(first, count, out)
                                      : mesh.read_array(array, first, count, out);
}

Result<std::vector<ArrayMaps>> sample_maps(MeshSource& mesh, const EncodeOptions& options) {
  std::vector<ArrayMaps> maps;
  maps.push_back(MAILLE_TRY(ArraySampler(mesh, positions_of_source, options.positions).choose()));
  for (size_t i = 0; i < mesh.description().arrays.size(); ++i) {
    const auto found = options.arrays.find(mesh.description().arrays[i].name);
    const Tolerance tolerance = found == options.arrays.end() ? Tolerance{} : found->second;
    maps.push_back(MAILLE_TRY(ArraySampler(mesh, i, tolerance).choose()));
  }
  return maps;
}

ArrayToCode piece_to_code(const Array& piece, const ArrayMaps& maps) {
  ArrayToCode coded{&piece, maps};
  if (maps.lossless) return coded;
  const size_t size = size_of(piece.type);
  for (size_t i = 0; i < piece.bytes.size() / size; ++i) {
    if (!maps.maps[i % piece.components].reaches(piece.type, piece.bytes.data() + i * size))
      coded.maps.exceptions.push_back(i);
  }
  return coded;
}

}  // namespace maille
