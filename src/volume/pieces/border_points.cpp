#include "volume/pieces/border_points.h"

#include <maille/with_type.h>

#include <algorithm>
#include <array>
#include <limits>

#include "base/bytes.h"
#include "base/hash.h"
#include "volume/cells/cell_shape.h"

namespace maille {
namespace {

/// A face adds its sum to each of its points, by exclusive or; the two cells of an inner face cancel. 0 is
/// left at inner points. The sum of a face does not depend on the order of its corners, as mixed numbers are
/// added.
class FaceSums {
 public:
  FaceSums(uint64_t points, std::span<const uint32_t> number) : sums_(points), mixed_(points) {
    for (uint64_t i = 0; i < points; ++i) mixed_[i] = split_mix(number.empty() ? i : number[i]);
  }
  // Polygons and lines are one face of their corners, with all their nodes as points.
  void add_shape(const CellShape& shape, std::span<const uint32_t> points) {
    if (shape.dimension < 3) return add_face(points.first(shape.corners), points);
    // A point is in several faces: the cell's own sums first, then each point once.
    NodeSums mixed, sums;
    for (unsigned k = 0; k < shape.corners; ++k) mixed[k] = mixed_[points[shape.place[k]]];
    for (unsigned k = 0; k < shape.nodes; ++k) sums[k] = 0;
    for (unsigned f = 0; f < shape.faces; ++f) {
      const CellFace& face = shape.face[f];
      const uint64_t sum =
          face.size == 3 ? add_to_corners<3>(face, mixed, sums) : add_to_corners<4>(face, mixed, sums);
      if (shape.nodes > shape.corners) add_to_others(shape, face, sum, sums);
    }
    for (unsigned k = 0; k < shape.nodes; ++k) sums_[points[shape.place[k]]] ^= sums[k];
  }
  void add_face(std::span<const uint32_t> corners, std::span<const uint32_t> points) {
    uint64_t sum = 0;
    for (const uint32_t corner : corners) sum += mixed_[corner];
    sum = split_mix(sum);
    for (const uint32_t point : points) sums_[point] ^= sum;
  }
  const std::vector<uint64_t>& sums() const { return sums_; }

 private:
  using NodeSums = std::array<uint64_t, most_nodes>;

  /// Adds a face of a known size to the sums of its corners. Loops of a known length are much faster here.
  template <unsigned size>
  static uint64_t add_to_corners(const CellFace& face, const NodeSums& mixed, NodeSums& sums) {
    uint64_t sum = 0;
    for (unsigned k = 0; k < size; ++k) sum += mixed[face.corner[k]];
    sum = split_mix(sum);
    for (unsigned k = 0; k < size; ++k) sums[face.corner[k]] ^= sum;
    return sum;
  }
  /// Adds the sum of a face to the nodes behind the corners that lie within it.
  static void add_to_others(const CellShape& shape, const CellFace& face, uint64_t sum, NodeSums& sums) {
    unsigned corners = 0;
    for (unsigned k = 0; k < face.size; ++k) corners |= 1u << face.corner[k];
    for (unsigned node = shape.corners; node < shape.nodes; ++node) {
      if ((shape.lies_on[node] & ~corners) == 0) sums[node] ^= sum;
    }
  }

  std::vector<uint64_t> sums_, mixed_;
};

template <class T>
std::vector<uint8_t> find_on_sides(const std::byte* positions, uint64_t count,
                                   std::span<const uint32_t> points) {
  const auto number = [&](uint64_t point, unsigned k) {
    return load<T>(positions + (3 * point + k) * sizeof(T));
  };
  using Limits = std::numeric_limits<T>;
  std::array<T, 3> low, high;
  low.fill(Limits::has_infinity ? Limits::infinity() : Limits::max());
  high.fill(Limits::has_infinity ? -Limits::infinity() : Limits::lowest());
  for (uint64_t i = 0; i < count; ++i) {
    for (unsigned k = 0; k < 3; ++k) {
      // In this order NaN changes nothing: a comparison with it is false, and the first argument stays.
      // In this order NaN changes nothing.
      low[k] = std::min(low[k], number(i, k));
      high[k] = std::max(high[k], number(i, k));
    }
  }
  std::vector<uint8_t> on_side;
  on_side.reserve(points.size());
  for (const uint32_t point : points) {
    bool is = false;
    for (unsigned k = 0; k < 3; ++k) is = is || number(point, k) == low[k] || number(point, k) == high[k];
    on_side.push_back(is ? 1 : 0);
  }
  return on_side;
}

// A polyhedron has the faces that are given.
void add_polyhedron(const CellBlock& block, uint64_t cell, FaceSums& sums) {
  auto points = block.cell(cell);
  for (const uint32_t size : block.faces(cell)) {
    sums.add_face(points.first(size), points.first(size));
    points = points.subspan(size);
  }
}

}  // namespace

std::vector<uint32_t> border_points(const Mesh& piece, std::span<const uint32_t> number) {
  FaceSums sums(piece.point_count(), number);
  for (const CellBlock& block : piece.blocks) {
    const uint64_t cells = block.size();
    for (uint64_t i = 0; i < cells; ++i) {
      const CellType type = block.type_of(i);
      const unsigned kind = kind_of(type);
      if (kind < shape_count) {
        sums.add_shape(cell_shapes[kind], block.cell(i));
      } else if (type == CellType::polyhedron) {
        add_polyhedron(block, i, sums);
      } else {
        sums.add_face(block.cell(i), block.cell(i));
      }
    }
  }
  // In the coded order.
  std::vector<bool> on_border(piece.point_count());
  for (uint64_t i = 0; i < on_border.size(); ++i) {
    if (sums.sums()[i] != 0) on_border[number.empty() ? i : number[i]] = true;
  }
  std::vector<uint32_t> border;
  for (uint32_t i = 0; i < on_border.size(); ++i) {
    if (on_border[i]) border.push_back(i);
  }
  return border;
}

std::vector<uint8_t> on_sides(const Array& positions, std::span<const uint32_t> points) {
  return with_type(positions.type, [&](auto zero) {
    return find_on_sides<decltype(zero)>(positions.bytes.data(), positions.count(), points);
  });
}

}  // namespace maille
