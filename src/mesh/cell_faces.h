#pragma once

#include <maille/faces.h>
#include <maille/mesh.h>
#include <maille/mesh_source.h>

#include <array>
#include <span>

namespace maille {

/// Calls f(corners) for each face of a polyhedron, whose nodes are the corners of its faces.
template <class Node, class F>
void for_each_face(std::span<const Node> nodes, std::span<const uint32_t> face_sizes, F f) {
  for (const uint32_t size : face_sizes) {
    f(nodes.first(size));
    nodes = nodes.subspan(size);
  }
}
/// And for each face of another solid: in a cycle, of curved ones by their corners alone. At most six
/// corners.
template <class F>
void for_each_face(const FacesOfSolid& faces, std::span<const uint32_t> nodes, F f) {
  std::array<uint32_t, 6> corners{};
  for (unsigned i = 0; i < faces.count; ++i) {
    const auto places = faces.face(i);
    for (size_t k = 0; k < places.size(); ++k) corners[k] = nodes[places[k]];
    f(std::span<const uint32_t>(corners).first(places.size()));
  }
}
/// Of any cell: those that are no solids have none.
template <class F>
void for_each_face(const CellBlock& block, uint64_t cell, F f) {
  if (block.type_of(cell) == CellType::polyhedron) {
    for_each_face(block.cell(cell), block.faces(cell), f);
  } else {
    for_each_face(faces_of(block.type_of(cell)), block.cell(cell), f);
  }
}

/// The sizes of the faces of a cell; none where it is no polyhedron.
inline std::span<const uint32_t> face_sizes_of(const CellPiece& cells, uint64_t i) {
  if (cells.cell_faces.empty()) return {};
  return std::span(cells.face_sizes)
      .subspan(cells.cell_faces[i], cells.cell_faces[i + 1] - cells.cell_faces[i]);
}
/// Appends a cell to a piece that has an offset at least.
template <class Nodes>
void append_cell(CellType type, const Nodes& nodes, std::span<const uint32_t> face_sizes, CellPiece& to) {
  to.types.push_back(static_cast<uint8_t>(type));
  to.connectivity.insert(to.connectivity.end(), nodes.begin(), nodes.end());
  to.offsets.push_back(to.connectivity.size());
  if (type != CellType::polyhedron && to.cell_faces.empty()) return;
  // When the first polyhedron of a piece comes, the cells before it get empty lists of faces.
  to.cell_faces.resize(to.types.size(), to.face_sizes.size());
  to.face_sizes.insert(to.face_sizes.end(), face_sizes.begin(), face_sizes.end());
  to.cell_faces.push_back(to.face_sizes.size());
}

}  // namespace maille
