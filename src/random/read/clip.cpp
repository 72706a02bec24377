// Which faces have a point in a region.
#include <maille/random_access.h>

#include <algorithm>
#include <cmath>

#include "mesh/cut_out.h"
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

/// Exact for triangles, but for rounding: what is left of the triangle within all planes is measured against
/// the sphere. Boxes are six planes more.
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

}  // namespace

Mesh keep_cells(const Mesh& mesh, const std::vector<bool>& keep) {
  std::vector<uint32_t> cells;
  for (uint32_t cell = 0; cell < keep.size(); ++cell) {
    if (keep[cell]) cells.push_back(cell);
  }
  return cut_out(mesh, cells, CutArrays::all).mesh;
}

Mesh clip(const Mesh& mesh, const Region& region) {
  // Points of no cell, and cells without points, lie in all of space, too.
  if (!region.box && !region.sphere && region.planes.empty()) return mesh;
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
