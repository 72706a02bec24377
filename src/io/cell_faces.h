#pragma once

#include <maille/mesh.h>
#include <array>
#include <span>

namespace maille {

/// The faces of a linear cell as places in its list of nodes, -1 behind a triangle; normals point outwards.
inline std::span<const std::array<int8_t, 4>> faces_of(CellType type) {
  using Face = std::array<int8_t, 4>;
  static constexpr Face tetrahedron[] = {{0, 1, 3, -1}, {1, 2, 3, -1}, {2, 0, 3, -1}, {0, 2, 1, -1}};
  static constexpr Face hexahedron[] = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                                        {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}};
  static constexpr Face wedge[] = {{0, 1, 2, -1}, {3, 5, 4, -1}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}};
  static constexpr Face pyramid[] = {
      {0, 3, 2, 1}, {0, 1, 4, -1}, {1, 2, 4, -1}, {2, 3, 4, -1}, {3, 0, 4, -1}};
  switch (type) {
    case CellType::tetrahedron:
      return tetrahedron;
    case CellType::hexahedron:
      return hexahedron;
    case CellType::wedge:
      return wedge;
    case CellType::pyramid:
      return pyramid;
    default:
      return {};
  }
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
  const auto faces = faces_of(type);
  uint32_t corners[4];
  for (const auto& face : faces) {
    size_t size = 0;
    for (; size < 4 && face[size] >= 0; ++size) corners[size] = nodes[static_cast<size_t>(face[size])];
    f(std::span<const uint32_t>(corners, size));
  }
  return !faces.empty();
}
template <class F>
bool for_each_face(const CellBlock& block, uint64_t cell, F f) {
  const CellType type = block.type_of(cell);
  return for_each_face(type, block.cell(cell),
                       type == CellType::polyhedron ? block.faces(cell) : std::span<const uint32_t>(), f);
}

}  // namespace maille
