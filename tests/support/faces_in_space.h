#pragma once

// Meshes as what the hierarchy is built from.

#include <maille/mesh.h>

#include <vector>

#include "random/build/spatial_graph.h"
#include "support/shapes.h"
#include "support/sine.h"

namespace maille::testing {

struct FacesInSpace {
  std::vector<uint32_t> corners, first;
  std::vector<float> positions;

  FaceLists lists() const { return {corners, first}; }
  uint32_t vertices() const { return static_cast<uint32_t>(positions.size() / 3); }
  SpatialGraph graph() const { return dual_graph(lists(), positions, vertices()); }
};

/// All cells, whatever their type. Positions must be f32.
inline FacesInSpace faces_in_space(const Mesh& mesh) {
  FacesInSpace result;
  result.first.push_back(0);
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto cell = block.cell(i);
      result.corners.insert(result.corners.end(), cell.begin(), cell.end());
      result.first.push_back(static_cast<uint32_t>(result.corners.size()));
    }
  }
  const auto numbers = mesh.points.values<float>();
  result.positions.assign(numbers.begin(), numbers.end());
  return result;
}

inline FacesInSpace faces_in_space(const Surface& surface) {
  return faces_in_space(to_mesh(surface));
}

/// n x n squares of two triangles each, with hills.
inline FacesInSpace hills(uint32_t n, double height) {
  FacesInSpace result;
  for (uint32_t y = 0; y <= n; ++y) {
    for (uint32_t x = 0; x <= n; ++x) {
      const double z = height * sine(0.3 * x) * cosine(0.2 * y);
      result.positions.insert(result.positions.end(),
                              {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
    }
  }
  for (uint32_t y = 0; y < n; ++y) {
    for (uint32_t x = 0; x < n; ++x) {
      const uint32_t a = y * (n + 1) + x, b = a + n + 1;
      result.corners.insert(result.corners.end(), {a, a + 1, b + 1, a, b + 1, b});
    }
  }
  return result;
}

}  // namespace maille::testing
