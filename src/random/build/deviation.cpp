#include "random/build/deviation.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "random/mesh_geometry.h"
#include "random/read/triangle_tree.h"

namespace maille {
namespace {

double squared(const Vector3& d) {
  return dot(d, d);
}

/// The triangles at each vertex.
struct VertexTriangles {
  std::vector<uint32_t> first, triangles;

  VertexTriangles(std::span<const uint32_t> corners, size_t vertices)
      : first(vertices + 1), triangles(corners.size()) {
    for (const uint32_t v : corners) ++first[v + 1];
    for (size_t v = 0; v < vertices; ++v) first[v + 1] += first[v];
    std::vector<uint32_t> next(first.begin(), first.end() - 1);
    for (uint32_t i = 0; i < corners.size(); ++i) triangles[next[corners[i]]++] = i / 3;
  }
};

/// Boxes opened for one vertex. On surfaces a few dozen tell what is nearest; among triangles anywhere nearly
/// all are near everything, and the distance found by then is a bound as well, if not the least one.
constexpr unsigned most_boxes = 256;

/// The squared distance of the farthest removed vertex from the triangles that are left.
double removed_vertices(const SimplifierInput& input, const Simplified& simplified) {
  const TriangleTree tree(simplified.triangles, input.positions);
  const VertexTriangles around(simplified.triangles, input.locked.size());
  std::vector<uint8_t> used(input.locked.size()), was_used(input.locked.size());
  for (const uint32_t v : input.triangles) was_used[v] = 1;
  for (const uint32_t v : simplified.triangles) used[v] = 1;
  double worst = 0;
  for (uint32_t v = 0; v < input.locked.size(); ++v) {
    if (used[v] || !was_used[v]) continue;
    const Vector3 from = finite_position(input.positions, v);
    const uint32_t root = simplified.root[v];
    // No nearer than the root, and mostly at a triangle around it; one that is as near as the worst so far
    // changes nothing.
    double bound = squared(from - finite_position(input.positions, root));
    for (uint32_t i = around.first[root]; i < around.first[root + 1] && bound > worst; ++i)
      bound = std::min(bound, tree.to_triangle(from, around.triangles[i]));
    if (bound <= worst) continue;
    worst = std::max(worst, used[root] ? tree.squared_distance(from, bound, worst, most_boxes) : bound);
  }
  return worst;
}

}  // namespace

double deviation(const SimplifierInput& input, const Simplified& simplified) {
  const double worst = removed_vertices(input, simplified);
  const double error = std::max(std::sqrt(worst), simplified.lost_component);
  return error * (1 + 1e-12);
}

}  // namespace maille
