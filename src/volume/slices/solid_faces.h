#pragma once

#include <maille/faces.h>
#include <maille/mesh.h>

#include <array>
#include <span>

namespace maille {

/// Calls f(corners) for each face of a solid, by numbers of points in a cycle; of curved solids by their
/// corners alone. Other cells have none. At most six corners, but of polyhedra.
template <class F>
void for_each_face(const CellBlock& block, uint64_t cell, F f) {
  const auto points = block.cell(cell);
  if (block.type_of(cell) == CellType::polyhedron) {
    size_t at = 0;
    for (const uint32_t size : block.faces(cell)) {
      f(points.subspan(at, size));
      at += size;
    }
    return;
  }
  const FacesOfSolid& faces = faces_of(block.type_of(cell));
  std::array<uint32_t, 6> corners{};
  for (unsigned i = 0; i < faces.count; ++i) {
    const auto nodes = faces.face(i);
    for (size_t k = 0; k < nodes.size(); ++k) corners[k] = points[nodes[k]];
    f(std::span<const uint32_t>(corners).first(nodes.size()));
  }
}

}  // namespace maille
