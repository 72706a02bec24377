#pragma once

#include <maille/faces.h>
#include <maille/mesh.h>

#include <span>

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
bool for_each_face(CellType type, std::span<const uint32_t> nodes, std::span<const uint32_t> face_sizes,
                   F f) {
  if (type == CellType::polyhedron) {
    for (const uint32_t size : face_sizes) {
      f(nodes.first(size));
      nodes = nodes.subspan(size);
    }
    return true;
  }
  // No linear cell has a face of more than four corners.
  const FacesOfSolid& faces = faces_of_linear(type);
  uint32_t corners[4];
  for (unsigned i = 0; i < faces.count; ++i) {
    size_t size = 0;
    for (const uint8_t place : faces.face(i)) corners[size++] = nodes[place];
    f(std::span<const uint32_t>(corners, size));
  }
  return faces.count > 0;
}
template <class F>
bool for_each_face(const CellBlock& block, uint64_t cell, F f) {
  const CellType type = block.type_of(cell);
  return for_each_face(type, block.cell(cell),
                       type == CellType::polyhedron ? block.faces(cell) : std::span<const uint32_t>(), f);
}

}  // namespace maille
