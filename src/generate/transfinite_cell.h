#pragma once

#include <maille/mesh.h>
#include <array>
#include <cstdint>

namespace maille {

/// A cell as it is left when some corners of a hexahedron are one point.
struct ReducedCell {
  CellType type = CellType::hexahedron;
  uint8_t count = 8;
  std::array<uint8_t, 8> corner{0, 1, 2, 3, 4, 5, 6, 7};  ///< of the hexahedron, for each node
};

/// Makes a wedge, pyramid or tetrahedron of a hexahedron with repeated nodes (eight of them); anything else
/// stays a hexahedron. Orientation is kept.
ReducedCell reduce_hexahedron(const uint64_t* nodes);

}  // namespace maille
