#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace maille {

/// Some cells of a mesh as a mesh of their own, with points in the order of the whole mesh.
struct SubMesh {
  Mesh mesh;                     ///< blocks without cells are left out, arrays of the mesh as a whole, too
  std::vector<uint32_t> points;  ///< by point, its number in the whole mesh; rising
  std::vector<uint32_t> block_numbers;  ///< by block, its number in the whole mesh; rising
};

/// `cells`: their numbers through all blocks, rising.
SubMesh take_cells(const Mesh& mesh, std::span<const uint32_t> cells);

/// Points that no cell uses: those of `numbers` as a mesh without cells. `numbers` rise.
SubMesh take_points(const Mesh& mesh, std::vector<uint32_t> numbers);

}  // namespace maille
