#include "hierarchy/deviation.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "hierarchy/triangle_tree.h"

namespace maille {
namespace {

Vector3 position(std::span<const float> positions, uint32_t vertex) {
  Vector3 p;
  for (unsigned k = 0; k < 3; ++k) {
    const auto x = static_cast<double>(positions[size_t{3} * vertex + k]);
    p[k] = std::isfinite(x) ? x : 0;
  }
  return p;
}

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
    const Vector3 from = position(input.positions, v);
    const uint32_t root = simplified.root[v];
    // No nearer than the root; one that is as near as the worst so far changes nothing.
    const double bound = squared(from - position(input.positions, root));
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
