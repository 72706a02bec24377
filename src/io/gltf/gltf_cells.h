#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <string>
#include <vector>

namespace maille {

/// Cells as glTF draws them: one draw call, of one mode and one material.
struct GltfPrimitive {
  enum Mode : int { points = 0, lines = 1, line_strip = 3, triangles = 4 };
  Mode mode = triangles;
  size_t block = 0;
  int material = -1;
  std::vector<uint32_t> indices;  ///< into the points written; empty: all of them in order
  uint32_t least = 0, most = 0;   ///< point used
};

/// What a mesh becomes in glTF: triangles, lines and points, and points that carry the values of corners, as
/// glTF has no arrays on corners.
struct GltfCells {
  static constexpr uint64_t no_corner = UINT64_MAX;

  std::vector<GltfPrimitive> primitives;  ///< in the order of the blocks
  const Array* material = nullptr;        ///< the cell array that became materials
  std::vector<std::string> materials;     ///< names

  uint64_t point_count = 0;               ///< written
  std::vector<uint32_t> old_point;        ///< of each point written; empty: the points as they are
  std::vector<uint64_t> corner_of_point;  ///< one whose values the point carries, or no_corner
};

/// Polygons are cut into fans, points split where corner arrays differ; `notes` say so. Error: usage, when no
/// cell can be written although there are some, and for more than 2^32 points after splitting.
Result<GltfCells> collect_gltf_cells(const Mesh& mesh, std::vector<std::string>& notes);

}  // namespace maille
