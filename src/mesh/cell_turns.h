#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>
#include <span>

namespace maille {

/// A cell turned upon itself: its corner k is corner[k] of the cell as it was, its face k face[k]. Faces are
/// those of faces_of(), of polygons the edges from each corner to the next. Turns keep the inside inside:
/// there are no mirror images among them. Twelve for a tetrahedron, 24 for a hexahedron, four and six for
/// pyramids and wedges.
struct CellTurn {
  std::array<uint8_t, 8> corner{};
  std::array<uint8_t, 6> face{};
};

/// All turns of a triangle, quad, tetrahedron, pyramid, wedge, or hexahedron, the first of which changes
/// nothing. Other types have none. The order never changes, as orders of gates keep a turn by its number
/// (gate_order.h).
std::span<const CellTurn> turns_of(CellType type);

}  // namespace maille
