#pragma once

#include "mesh/cell_faces.h"

namespace maille {

/// The faces of the four linear cells that formats of faces know; none for all other types (no vertex has a
/// face).
inline const FacesOfSolid& faces_of_linear(CellType type) {
  const bool linear = type == CellType::tetrahedron || type == CellType::hexahedron ||
                      type == CellType::wedge || type == CellType::pyramid;
  return faces_of(linear ? type : CellType::vertex);
}

/// Calls f(corners) for every face of a polyhedron or linear volume cell. False for cells that have none.
/// `face_sizes`: of a polyhedron, whose nodes are the corners of its faces.
template <class F>
bool for_each_linear_face(CellType type, std::span<const uint32_t> nodes,
                          std::span<const uint32_t> face_sizes, F f) {
  if (type == CellType::polyhedron) {
    for_each_face(nodes, face_sizes, f);
    return true;
  }
  const FacesOfSolid& faces = faces_of_linear(type);
  for_each_face(faces, nodes, f);
  return faces.count > 0;
}
template <class F>
bool for_each_linear_face(const CellBlock& block, uint64_t cell, F f) {
  return for_each_linear_face(block.type_of(cell), block.cell(cell), block.faces(cell), f);
}

}  // namespace maille
