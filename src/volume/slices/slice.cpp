#include <maille/slice.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "base/bytes.h"
#include "mesh/cell_faces.h"
#include "mesh/empty_like.h"
#include "numbers/number_map.h"
#include "numbers/point_position.h"

namespace maille {
namespace {

/// A point of the slice: on an edge from one point of the mesh to another, the lower number first, so that
/// all cells at the edge give the same point.
struct Crossing {
  uint32_t from = 0, to = 0;
  double share = 0;  ///< of the way
};

void store_float(Scalar type, double value, std::byte* out) {
  if (type == Scalar::f32) {
    store(out, static_cast<float>(value));
  } else {
    store(out, value);
  }
}

/// Cuts cells by a plane into polygons, one point for each edge that crosses it. Polygons of neighbours share
/// points, so that the slice is as connected as the mesh.
class Slicer {
 public:
  Slicer(const Mesh& mesh, const Region::Plane& plane) : mesh_(mesh) {
    sides_.resize(mesh.point_count());
    for (uint32_t point = 0; point < sides_.size(); ++point)
      sides_[point] = dot(plane.normal, point_position(mesh.points, point)) + plane.offset;
  }

  Mesh run() {
    uint32_t number = 0;
    for (const CellBlock& block : mesh_.blocks) {
      CellBlock to;
      to.name = block.name;
      to.offsets.push_back(0);
      const uint64_t cells = block.size();
      for (uint64_t i = 0; i < cells; ++i, ++number) {
        if (passes(block.cell(i))) cut(block, i, number, to);
      }
      if (to.size() > 0) sliced_.blocks.push_back(std::move(to));
    }
    take_points();
    return std::move(sliced_);
  }

 private:
  /// On the plane counts as above it, so that a point is never on both sides and each crossing edge has its
  /// ends apart. Points that are nowhere are on no side.
  bool is_above(uint32_t point) const { return sides_[point] >= 0; }
  bool passes(std::span<const uint32_t> points) const {
    bool above = false, below = false;
    for (const uint32_t point : points) {
      if (!std::isfinite(sides_[point])) return false;
      above = above || is_above(point);
      below = below || !is_above(point);
    }
    return above && below;
  }

  /// The number of the crossing on an edge, a new one if no cell has asked before. Sides differ in sign, so
  /// that the share is from 0 to 1.
  uint32_t crossing(uint32_t a, uint32_t b) {
    const uint32_t from = std::min(a, b), to = std::max(a, b);
    const auto [found, added] =
        numbers_.try_emplace(uint64_t{from} << 32 | to, static_cast<uint32_t>(crossings_.size()));
    if (added) crossings_.push_back({from, to, sides_[from] / (sides_[from] - sides_[to])});
    return found->second;
  }

  /// The polygons in which the plane cuts one cell. Each face joins the edges where it is left with those
  /// where it is entered next; each edge is one of two faces, so that the lines close. Faces that are not
  /// convex give several lines.
  void cut(const CellBlock& block, uint64_t cell, uint32_t number, CellBlock& to) {
    lines_.clear();
    for_each_face(block, cell, [&](std::span<const uint32_t> corners) {
      entries_.clear();
      for (size_t k = 0; k < corners.size(); ++k) {
        const uint32_t a = corners[k], b = corners[(k + 1) % corners.size()];
        if (is_above(a) != is_above(b)) entries_.push_back({crossing(a, b), is_above(b)});
      }
      for (size_t k = 0; k < entries_.size(); ++k) {
        const Entry& entry = entries_[k];
        if (entry.up) lines_.push_back({entry.crossing, entries_[(k + 1) % entries_.size()].crossing});
      }
    });
    while (!lines_.empty()) add_polygon(number, to);
  }
  /// Follows lines from crossing to crossing until they close; each turn takes a line away, so that the loop
  /// ends for any faces.
  void add_polygon(uint32_t number, CellBlock& to) {
    const size_t first = to.connectivity.size();
    const uint32_t begin = lines_.back().from;
    uint32_t next = lines_.back().to;
    lines_.pop_back();
    to.connectivity.push_back(begin);
    while (next != begin) {
      to.connectivity.push_back(next);
      // Either way round: faces of polyhedra may not all look outwards.
      const auto found = std::find_if(lines_.begin(), lines_.end(),
                                      [&](const Line& line) { return line.from == next || line.to == next; });
      if (found == lines_.end()) break;  // a solid that is not closed
      next = found->from == next ? found->to : found->from;
      lines_.erase(found);
    }
    // A plane through an edge or a corner leaves less than a triangle.
    if (to.connectivity.size() - first < 3) {
      to.connectivity.resize(first);
      return;
    }
    to.offsets.push_back(to.connectivity.size());
    cells_.push_back(number);
  }

  // Positions become doubles, as a crossing is at no float of the mesh; arrays keep their types.
  void take_points() {
    sliced_.points = make_array(mesh_.points.name, Domain::point, Scalar::f64, 3);
    interpolate(mesh_.points, sliced_.points);
    for (const Array& array : mesh_.arrays) {
      if (array.domain != Domain::point && array.domain != Domain::cell) continue;
      Array& to = sliced_.arrays.emplace_back(empty_like(array));
      if (array.domain == Domain::point) {
        interpolate(array, to);
        continue;
      }
      const size_t size = array.tuple_size();
      to.resize(cells_.size());
      for (size_t i = 0; i < cells_.size(); ++i)
        std::copy_n(array.bytes.data() + cells_[i] * size, size, to.bytes.data() + i * size);
    }
  }
  /// Along the edge. What is no float, and values that would not be finite, are those of the nearer end.
  void interpolate(const Array& from, Array& to) const {
    to.resize(crossings_.size());
    const size_t from_size = size_of(from.type), to_size = size_of(to.type);
    for (size_t i = 0; i < crossings_.size(); ++i) {
      const Crossing& crossing = crossings_[i];
      for (uint32_t k = 0; k < from.components; ++k) {
        const std::byte* a = from.bytes.data() + (size_t{crossing.from} * from.components + k) * from_size;
        const std::byte* b = from.bytes.data() + (size_t{crossing.to} * from.components + k) * from_size;
        std::byte* out = to.bytes.data() + (i * to.components + k) * to_size;
        const double x = number_as_double(from.type, a), y = number_as_double(from.type, b);
        const double value = x + (y - x) * crossing.share;
        if (is_float(to.type) && std::isfinite(value)) {
          store_float(to.type, value, out);
        } else {
          std::copy_n(crossing.share <= 0.5 ? a : b, to_size, out);
        }
      }
    }
  }

  struct Entry {
    uint32_t crossing;
    bool up;  ///< from below to above
  };
  struct Line {
    uint32_t from, to;
  };
  const Mesh& mesh_;
  std::vector<double> sides_;
  Mesh sliced_;
  std::vector<Crossing> crossings_;
  std::unordered_map<uint64_t, uint32_t> numbers_;  ///< by edge; only looked up
  std::vector<Entry> entries_;
  std::vector<Line> lines_;
  std::vector<uint32_t> cells_;  ///< by polygon
};

}  // namespace

Mesh slice(const Mesh& mesh, const Region::Plane& plane) {
  return Slicer(mesh, plane).run();
}

}  // namespace maille
