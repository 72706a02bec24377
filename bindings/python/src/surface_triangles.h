#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <vector>

namespace maille::python {

/// Triangles to draw a mesh by: its faces, polygons as fans from their first corner, and of solids the faces
/// that no other solid has. Of curved cells the corners; lines and points have none.
struct SurfaceTriangles {
  std::vector<uint32_t> corners;  ///< three each
  std::vector<uint64_t> cells;    ///< by triangle, through all blocks
};
SurfaceTriangles surface_triangles(const Mesh& mesh);

}  // namespace maille::python
