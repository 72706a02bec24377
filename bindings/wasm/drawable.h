#pragma once

#include <maille/geometry.h>
#include <maille/mesh.h>

#include <optional>
#include <vector>

namespace maille::wasm {

/// What a screen can show of a mesh: its faces, and the faces of its solids that no other solid has, as
/// triangles over vertices in single precision. A point is a vertex once for each tuple that its corners
/// have.
struct Drawable {
  Vector3 origin;                   ///< to be added to positions: far from zero floats are too coarse
  std::vector<float> positions;     ///< 3 per vertex
  std::vector<uint32_t> points;     ///< by vertex: the point of the mesh
  std::vector<uint32_t> triangles;  ///< 3 vertices each
  std::vector<uint32_t> cells;      ///< by triangle: the cell of the mesh, through all blocks
  std::vector<uint32_t> faces;  ///< by face: its first triangle; the others, around its first corner, follow
  uint32_t flat_faces = 0;      ///< of these, that come first: flat cells of the mesh
  std::vector<Array> arrays;    ///< those on points and corners, a tuple per vertex
  std::vector<Array> of_triangles;  ///< those on cells, a tuple per triangle, where they were asked for
};

/// Without an origin it is the first vertex. Parts of one mesh that are to fit at their borders need the same
/// one.
Drawable draw(const Mesh& mesh, const std::optional<Vector3>& origin = {});

/// Triangles whose corners have nothing of their own, in one block: most charts. What is drawn is the mesh
/// itself.
bool is_plain(const Mesh& mesh);

/// Values of cells where they are drawn.
void spread_cell_arrays(const Mesh& mesh, Drawable& drawable);

}  // namespace maille::wasm
