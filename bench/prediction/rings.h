#pragma once

#include <algorithm>
#include <vector>

#include "triangles.h"

namespace maille::bench {

/// The ring of a vertex, in order: each triangle (v, a, b) leads from a to b. Empty unless it is one closed
/// loop of all its triangles, 3 to `largest` of them.
inline std::vector<uint32_t> closed_ring(const EdgeFinder& edges, uint32_t v, size_t largest) {
  const auto triangles = edges.around(v);
  if (triangles.size() < 3 || triangles.size() > largest) return {};
  const Triangle& face = triangles[0];
  const auto corner = static_cast<size_t>(std::find(face.begin(), face.end(), v) - face.begin());
  std::vector<uint32_t> ring{face[(corner + 1) % 3]};
  while (ring.size() < triangles.size()) {
    const uint32_t next = edges.tip(v, ring.back());
    if (next == EdgeFinder::none || next == ring.front()) return {};
    ring.push_back(next);
  }
  return edges.tip(v, ring.back()) == ring.front() ? ring : std::vector<uint32_t>();
}

}  // namespace maille::bench
