// Which faces have a point in a region.
#include <maille/random_access.h>

#include <algorithm>
#include <cmath>

#include "random/keep_cells.h"
#include "random/mesh_geometry.h"
#include "random/read/selection.h"

namespace maille {
namespace {

using Polygon = std::vector<Vector3>;

/// The part of a convex polygon that lies in a half-space (Sutherland and Hodgman 1974).
Polygon cut(const Polygon& polygon, const Vector3& normal, double offset) {
  Polygon left;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double at_a = dot(normal, a) + offset, at_b = dot(normal, b) + offset;
    if (at_a >= 0) left.push_back(a);
    if ((at_a >= 0) != (at_b >= 0)) left.push_back(a + (b - a) * (at_a / (at_a - at_b)));
  }
  return left;
}

class RegionTest {
 public:
  explicit RegionTest(const Region& region) : region_(region), planes_(region.planes) {
    for (unsigned k = 0; k < 3 && region.box; ++k) {
      Vector3 normal;
      normal[k] = 1;
      planes_.push_back({normal, -region.box->low[k]});
      planes_.push_back({normal * -1, region.box->high[k]});
    }
  }
  bool meets(Polygon polygon) const {
    for (const Region::Plane& plane : planes_) {
      if (polygon.empty()) return false;
      polygon = cut(polygon, plane.normal, plane.offset);
    }
    if (polygon.empty()) return false;
    if (!region_.sphere) return true;
    const double most = region_.sphere->radius * region_.sphere->radius;
    double nearest = squared_distance(region_.sphere->centre, polygon[0], polygon[0], polygon[0]);
    for (size_t i = 2; i < polygon.size(); ++i) {
      nearest =
          std::min(nearest, squared_distance(region_.sphere->centre, polygon[0], polygon[i - 1], polygon[i]));
    }
    return nearest <= most;
  }

 private:
  const Region& region_;
  std::vector<Region::Plane> planes_;
};

/// Takes the cells of `keep` and the points that they use.
class MeshCutter {
 public:
  MeshCutter(const Mesh& mesh, const std::vector<bool>& keep) : mesh_(mesh), keep_(keep) { find_elements(); }
  Mesh run() {
    Mesh result;
    result.metadata = mesh_.metadata;
    result.points = taken(mesh_.points, points_);
    for (const Array& array : mesh_.arrays) {
      result.arrays.push_back(array.domain == Domain::point    ? taken(array, points_)
                              : array.domain == Domain::cell   ? taken(array, cells_)
                              : array.domain == Domain::corner ? taken(array, corners_)
                                                               : array);
    }
    take_blocks(result);
    return result;
  }

 private:
  void find_elements() {
    std::vector<bool> used(mesh_.point_count());
    uint32_t cell = 0, corner = 0;
    for (const CellBlock& block : mesh_.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i, ++cell) {
        const auto nodes = block.cell(i);
        if (keep_[cell]) {
          cells_.push_back(cell);
          for (uint32_t k = 0; k < nodes.size(); ++k) corners_.push_back(corner + k);
          for (const uint32_t point : nodes) used[point] = true;
        }
        corner += static_cast<uint32_t>(nodes.size());
      }
    }
    number_.resize(used.size());
    for (uint32_t point = 0; point < used.size(); ++point) {
      if (!used[point]) continue;
      number_[point] = static_cast<uint32_t>(points_.size());
      points_.push_back(point);
    }
  }
  static Array taken(const Array& from, const std::vector<uint32_t>& tuples) {
    Array to = make_array(from.name, from.domain, from.type, from.components, from.role);
    to.labels = from.labels;
    const size_t size = from.tuple_size();
    to.bytes.reserve(tuples.size() * size);
    for (const uint32_t tuple : tuples) {
      const auto begin = from.bytes.begin() + static_cast<ptrdiff_t>(tuple * size);
      to.bytes.insert(to.bytes.end(), begin, begin + static_cast<ptrdiff_t>(size));
    }
    return to;
  }
  void take_blocks(Mesh& result) const {
    uint32_t cell = 0;
    for (const CellBlock& from : mesh_.blocks) {
      CellBlock& to = result.blocks.emplace_back();
      to.name = from.name;
      to.type = from.type;
      if (!from.offsets.empty()) to.offsets.push_back(0);
      for (uint64_t i = 0; i < from.size(); ++i, ++cell) {
        if (!keep_[cell]) continue;
        if (!from.types.empty()) to.types.push_back(from.types[i]);
        for (const uint32_t point : from.cell(i)) to.connectivity.push_back(number_[point]);
        if (!from.offsets.empty()) to.offsets.push_back(to.connectivity.size());
      }
    }
  }

  const Mesh& mesh_;
  const std::vector<bool>& keep_;
  std::vector<uint32_t> points_, cells_, corners_, number_;
};

}  // namespace

Mesh keep_cells(const Mesh& mesh, const std::vector<bool>& keep) {
  return MeshCutter(mesh, keep).run();
}

Mesh clip(const Mesh& mesh, const Region& region) {
  const RegionTest test(region);
  std::vector<bool> keep;
  Polygon polygon;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto nodes = block.cell(i);
      bool meets = false;
      const auto position = [&](uint32_t point) { return point_position(mesh.points, point); };
      // Polygons may be bent: each triangle of the fan for itself. Lines and points are thin polygons.
      for_each_fan_triangle(mesh.points, nodes, [&](uint32_t a, uint32_t b, uint32_t c) {
        meets = meets || test.meets({position(a), position(b), position(c)});
      });
      if (!nodes.empty() && nodes.size() < 3)
        meets = test.meets({position(nodes[0]), position(nodes.back())});
      keep.push_back(meets);
    }
  }
  return keep_cells(mesh, keep);
}

}  // namespace maille
