#include "hierarchy/deviation.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "hierarchy/mesh_geometry.h"
#include "hierarchy/triangle_tree.h"

namespace maille {
namespace {

double squared(const Vector3& d) {
  return dot(d, d);
}

double removed_vertices(const SimplifierInput& input, const Simplified& simplified) {
  const TriangleTree tree(simplified.triangles, input.positions);
  std::vector<uint8_t> used(input.locked.size()), was_used(input.locked.size());
  for (const uint32_t v : input.triangles) was_used[v] = 1;
  for (const uint32_t v : simplified.triangles) used[v] = 1;
  double worst = 0;
  for (uint32_t v = 0; v < input.locked.size(); ++v) {
    if (used[v] || !was_used[v]) continue;
    const Vector3 from = finite_position(input.positions, v);
    const uint32_t root = simplified.root[v];
    // No nearer than the root; one that is as near as the worst so far changes nothing.
    const double bound = squared(from - finite_position(input.positions, root));
    if (bound <= worst) continue;
    worst = std::max(worst, used[root] ? tree.squared_distance(from, bound) : bound);
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
