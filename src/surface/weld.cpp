#include "surface/weld.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "base/hash.h"
#include "mesh/none.h"
#include "surface/parts/coded_parts.h"

namespace maille {
namespace {

// With fewer twins than one point in so many a second encoding is not worth its time. Chosen, not measured:
// of 35 files that had this many none had fewer than one in thirteen.
constexpr uint64_t least_share = 64;
// Positions alone are welded only where a quarter of the points are twins, as in soups, whose faces have
// points of their own. What others save (featuretype at 14 bits 4 %) is not worth the gluing, which makes
// decoding two to five times as long (058e0cc). With arrays no such rule holds: pirate is 6 % smaller welded
// (120ca93).
constexpr uint64_t least_share_of_positions = 4;

std::span<const std::byte> tuple_of(const Array& array, uint32_t i) {
  return std::span(array.bytes).subspan(i * array.tuple_size(), array.tuple_size());
}
bool same_tuple(const Array& array, uint32_t a, uint32_t b) {
  return std::memcmp(tuple_of(array, a).data(), tuple_of(array, b).data(), array.tuple_size()) == 0;
}

/// For each of the keys, of `size` bytes each, the first one that is equal. A table with linear probing, at
/// most half full: sorting would lose the order of points.
std::vector<uint32_t> first_equal(Bytes keys, size_t size) {
  const auto key = [&](uint32_t i) { return keys.subspan(i * size, size); };
  const auto count = static_cast<uint32_t>(keys.size() / size);
  size_t slots = 16;
  // Hashes are of bytes that a file may choose, so probes can be long; memory stays bounded.
  while (slots < 2 * size_t{count}) slots *= 2;
  std::vector<uint32_t> table(slots, none), first(count);
  for (uint32_t i = 0; i < count; ++i) {
    size_t slot = hash64(key(i)) & (slots - 1);
    while (table[slot] != none && std::memcmp(key(table[slot]).data(), key(i).data(), size) != 0)
      slot = (slot + 1) & (slots - 1);
    if (table[slot] == none) table[slot] = i;
    first[i] = table[slot];
  }
  return first;
}

bool are_enough(std::span<const uint32_t> first, uint64_t share) {
  uint64_t twins = 0;
  for (uint32_t i = 0; i < first.size(); ++i) twins += first[i] != i;
  return twins > 0 && twins * share >= first.size();
}

/// For each point the first one at its place; empty if few have another. Counted before loss, so that a
/// lattice alone makes no mesh welded; then by the positions that the decoder will have.
std::vector<uint32_t> first_twins(const ArrayToCode& positions) {
  std::vector<uint32_t> first = first_equal(positions.array->bytes, positions.array->tuple_size());
  if (!are_enough(first, least_share)) return {};
  if (positions.maps.lossless) return first;
  const std::vector<Place> places = decoded_places(positions);
  return first_equal(std::as_bytes(std::span(places)), sizeof(Place));
}

/// A point of no cell has no corner that could name its twin.
bool all_used(const Mesh& mesh) {
  std::vector<bool> used(mesh.point_count());
  for (const CellBlock& block : mesh.blocks) {
    for (const uint32_t point : block.connectivity) used[point] = true;
  }
  return std::all_of(used.begin(), used.end(), [](bool is_used) { return is_used; });
}

bool differs_between_twins(const Array& array, std::span<const uint32_t> first) {
  for (uint32_t i = 0; i < first.size(); ++i) {
    if (first[i] != i && !same_tuple(array, first[i], i)) return true;
  }
  return false;
}

/// The tuples of the first twins.
void keep_first(Array& array, std::span<const uint32_t> first) {
  std::byte* to = array.bytes.data();
  for (uint32_t i = 0; i < first.size(); ++i) {
    if (first[i] != i) continue;
    std::memmove(to, tuple_of(array, i).data(), array.tuple_size());
    to += array.tuple_size();
  }
  array.bytes.resize(static_cast<size_t>(to - array.bytes.data()));
}

}  // namespace

std::optional<WeldedMesh> weld(const Mesh& mesh, const ArrayToCode& positions) {
  const std::vector<uint32_t> first = first_twins(positions);
  if (first.empty() || !all_used(mesh)) return std::nullopt;
  WeldedMesh welded;
  welded.mesh = mesh;
  for (Array& array : welded.mesh.arrays) {
    const bool by_twin = array.domain == Domain::point && differs_between_twins(array, first);
    if (by_twin) array.domain = Domain::corner;
    if (array.domain == Domain::point) keep_first(array, first);
    welded.by_twin.push_back(by_twin);
  }
  if (mesh.arrays.empty() && !are_enough(first, least_share_of_positions)) return std::nullopt;
  keep_first(welded.mesh.points, first);
  std::vector<uint32_t> number(first.size());
  for (uint32_t i = 0; i < first.size(); ++i) {
    number[i] = first[i] == i ? static_cast<uint32_t>(welded.kept.size()) : number[first[i]];
    if (first[i] == i) welded.kept.push_back(i);
  }
  for (CellBlock& block : welded.mesh.blocks) {
    welded.corner_twin.insert(welded.corner_twin.end(), block.connectivity.begin(), block.connectivity.end());
    for (uint32_t& point : block.connectivity) point = number[point];
  }
  return welded;
}

ArrayMaps welded_maps(const WeldedMesh& welded, ArrayMaps positions) {
  std::vector<uint64_t> exceptions;
  for (const uint64_t place : positions.exceptions) {
    const auto kept = std::lower_bound(welded.kept.begin(), welded.kept.end(), place / 3);
    if (kept != welded.kept.end() && *kept == place / 3)
      exceptions.push_back(3 * static_cast<uint64_t>(kept - welded.kept.begin()) + place % 3);
  }
  positions.exceptions = std::move(exceptions);
  return positions;
}

SplitPoints split_points(uint32_t points, std::span<const uint32_t> corners,
                         std::span<const uint32_t> twins) {
  // The corners of each point, by counting; then by number.
  std::vector<uint32_t> begin(size_t{points} + 1), order(corners.size());
  for (const uint32_t point : corners) ++begin[point + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<uint32_t> next(begin.begin(), begin.end() - 1);
  for (uint32_t corner = 0; corner < corners.size(); ++corner) order[next[corners[corner]]++] = corner;
  SplitPoints split;
  split.of_corner.resize(corners.size());
  for (uint32_t point = 0; point < points; ++point) {
    const auto from = order.begin() + begin[point], to = order.begin() + begin[point + 1];
    // Order among equals does not matter: all of them get one number.
    std::sort(from, to, [&](uint32_t a, uint32_t b) { return twins[a] < twins[b]; });
    if (from == to) split.welded.push_back(point);
    for (auto at = from; at != to; ++at) {
      if (at == from || twins[*at] != twins[*(at - 1)]) split.welded.push_back(point);
      split.of_corner[*at] = static_cast<uint32_t>(split.welded.size() - 1);
    }
  }
  return split;
}

std::vector<uint32_t> original_points(const WeldedMesh& welded, const ElementOrder& order,
                                      std::span<const uint32_t> twins) {
  // The corners of the decoded mesh, by those of the mesh that was coded.
  const CellTable cells = table_cells(welded.mesh);
  const auto corner_count = static_cast<uint32_t>(welded.corner_twin.size());
  std::vector<uint32_t> sources;
  for (size_t i = 0; i < order.cells.size(); ++i) {
    const uint32_t cell = order.cells[i], begin = cells.corner[cell];
    const uint32_t end = cell + 1 < cells.corner.size() ? cells.corner[cell + 1] : corner_count;
    for (uint32_t k = 0; k < end - begin; ++k)
      sources.push_back(begin + (k + order.rotation[i]) % (end - begin));
  }
  std::vector<uint32_t> decoded(order.points.size());
  for (uint32_t i = 0; i < decoded.size(); ++i) decoded[order.points[i]] = i;
  std::vector<uint32_t> welded_point;
  for (const CellBlock& block : welded.mesh.blocks)
    welded_point.insert(welded_point.end(), block.connectivity.begin(), block.connectivity.end());
  std::vector<uint32_t> corners, numbers;
  for (const uint32_t source : sources) {
    corners.push_back(decoded[welded_point[source]]);
    numbers.push_back(twins[source]);
  }
  const SplitPoints split = split_points(static_cast<uint32_t>(decoded.size()), corners, numbers);
  std::vector<uint32_t> points(split.welded.size());
  for (size_t i = 0; i < sources.size(); ++i) points[split.of_corner[i]] = welded.corner_twin[sources[i]];
  return points;
}

namespace {

/// The tuples of `array` at these places.
void take(Array& array, std::span<const uint32_t> places) {
  const size_t size = array.tuple_size();
  std::vector<std::byte> bytes(places.size() * size);
  for (size_t i = 0; i < places.size(); ++i)
    std::memcpy(&bytes[i * size], &array.bytes[places[i] * size], size);
  array.bytes = std::move(bytes);
}

}  // namespace

Result<Mesh> split_twins(Mesh mesh, std::span<const uint32_t> twins, const std::vector<bool>& by_twin,
                         uint64_t points) {
  std::vector<uint32_t> corners;
  for (const CellBlock& block : mesh.blocks)
    corners.insert(corners.end(), block.connectivity.begin(), block.connectivity.end());
  const SplitPoints split = split_points(static_cast<uint32_t>(mesh.point_count()), corners, twins);
  if (split.welded.size() != points)
    return failure(ErrorCode::corrupt, "the points are not as many as described");
  std::vector<uint32_t> corner_of(points);
  for (uint32_t corner = 0; corner < corners.size(); ++corner) corner_of[split.of_corner[corner]] = corner;
  take(mesh.points, split.welded);
  for (size_t i = 0; i < mesh.arrays.size(); ++i) {
    Array& array = mesh.arrays[i];
    if (array.domain == Domain::point) take(array, split.welded);
    if (!by_twin[i]) continue;
    take(array, corner_of);
    array.domain = Domain::point;
  }
  const uint32_t* corner = split.of_corner.data();
  for (CellBlock& block : mesh.blocks) {
    for (uint32_t& point : block.connectivity) point = *corner++;
  }
  return mesh;
}

}  // namespace maille
