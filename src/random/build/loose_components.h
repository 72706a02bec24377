#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "random/mesh_geometry.h"

namespace maille {

/// The components of triangles that have no locked vertex, so that they may vanish as a whole. A component is
/// named by its lowest vertex. Scans have thousands of small ones, which collapses cannot remove: they would
/// never get coarse.
class LooseComponents {
 public:
  struct Component {
    uint32_t name;
    float cost;  ///< square of what is lost with it: of half its diagonal
  };

  /// `alive`: the vertices that have faces, rising. `position_of`: of a vertex.
  template <class PositionOf>
  void find(std::span<const uint32_t> triangles, std::span<const uint32_t> alive,
            std::span<const uint8_t> locked, PositionOf position_of);

  const std::vector<Component>& all() const { return components_; }
  bool is_left(uint32_t name) const { return !gone_[name] && faces_[name] > 0; }
  uint32_t faces(uint32_t name) const { return faces_[name]; }
  bool is_gone_with(uint32_t vertex) const { return !components_.empty() && gone_[of_[vertex]] != 0; }

  void remove(uint32_t name) { gone_[name] = 1; }
  void lose_faces(uint32_t vertex, uint32_t count) {
    if (!components_.empty()) faces_[of_[vertex]] -= count;
  }

 private:
  void join(std::span<const uint32_t> triangles, size_t vertices);

  std::vector<uint32_t> of_;  ///< by vertex: the lowest one that hangs together with it
  std::vector<Component> components_;
  std::vector<uint8_t> gone_;    ///< by name; empty where there are no loose ones
  std::vector<uint32_t> faces_;  ///< likewise
};

inline void LooseComponents::join(std::span<const uint32_t> triangles, size_t vertices) {
  of_.resize(vertices);
  std::iota(of_.begin(), of_.end(), 0u);
  const auto root = [&](uint32_t v) {
    while (of_[v] != v) v = of_[v] = of_[of_[v]];
    return v;
  };
  for (size_t t = 0; t < triangles.size(); t += 3) {
    for (unsigned k = 1; k < 3; ++k) {
      const uint32_t a = root(triangles[t]), b = root(triangles[t + k]);
      of_[std::max(a, b)] = std::min(a, b);
    }
  }
  for (uint32_t v = 0; v < vertices; ++v) of_[v] = root(v);
}

template <class PositionOf>
void LooseComponents::find(std::span<const uint32_t> triangles, std::span<const uint32_t> alive,
                           std::span<const uint8_t> locked, PositionOf position_of) {
  join(triangles, locked.size());
  std::vector<uint8_t> is_locked(locked.size());
  for (const uint32_t v : alive) is_locked[of_[v]] |= locked[v];
  const auto is_loose = [&](uint32_t v) { return is_locked[of_[v]] == 0; };
  if (std::none_of(alive.begin(), alive.end(), is_loose)) return;
  gone_.assign(locked.size(), 0);
  faces_.assign(locked.size(), 0);
  for (size_t t = 0; t < triangles.size(); t += 3) ++faces_[of_[triangles[t]]];
  std::vector<Box> boxes(locked.size());
  // The lowest vertex of a component comes first.
  for (const uint32_t v : alive) enclose(boxes[of_[v]], position_of(v), of_[v] == v);
  for (const uint32_t v : alive) {
    if (of_[v] != v || is_locked[v] != 0) continue;
    const Vector3 size = boxes[v].high - boxes[v].low;
    components_.push_back({v, static_cast<float>(dot(size, size) / 4)});
  }
}

}  // namespace maille
