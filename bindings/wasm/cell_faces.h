#pragma once

#include <maille/faces.h>
#include <maille/mesh.h>

#include <array>
#include <span>

namespace maille::wasm {

/// The corners of a flat cell in a ring, which curved faces and pixels do not have first.
unsigned corners_of(CellType type, size_t nodes);

/// Calls of_solid(points) for each face of a solid, or of_surface(points, whole) for each face that a flat
/// cell is; `whole`: it is the cell itself, corner for corner. `sizes`: of a polyhedron's faces.
template <class OfSolid, class OfSurface>
void for_each_face(CellType type, std::span<const uint32_t> nodes, std::span<const uint32_t> sizes,
                   OfSolid of_solid, OfSurface of_surface) {
  using Points = std::span<const uint32_t>;
  if (type == CellType::polyhedron) {
    size_t at = 0;
    for (const uint32_t size : sizes) {
      of_solid(nodes.subspan(at, size));
      at += size;
    }
  } else if (dimension_of(type) == 3) {
    const FacesOfSolid& faces = faces_of(type);
    for (unsigned f = 0; f < faces.count; ++f) {
      std::array<uint32_t, 6> face;
      for (unsigned k = 0; k < faces.sizes[f]; ++k) face[k] = nodes[faces.nodes[f][k]];
      of_solid(Points(face.data(), faces.sizes[f]));
    }
  } else if (type == CellType::pixel) {
    of_surface(Points(std::array{nodes[0], nodes[1], nodes[3], nodes[2]}), false);
  } else if (type == CellType::triangle_strip) {
    for (size_t k = 2; k < nodes.size(); ++k) {
      const bool turned = k % 2 == 1;
      of_surface(Points(std::array{nodes[k - 2 + turned], nodes[k - 1 - turned], nodes[k]}), false);
    }
  } else if (dimension_of(type) == 2) {
    of_surface(nodes.first(corners_of(type, nodes.size())), true);
  }
}

}  // namespace maille::wasm
