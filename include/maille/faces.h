#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>
#include <span>

namespace maille {

/// Faces of a solid, by nodes in VTK's order, outwards; of curved solids by their corners.
struct FacesOfSolid {
  unsigned count = 0;
  std::array<std::array<uint8_t, 6>, 8> nodes{};
  std::array<uint8_t, 8> sizes{};
  /// Nodes of the i-th face, i < count.
  std::span<const uint8_t> face(unsigned i) const { return std::span(nodes[i]).first(sizes[i]); }
};

/// None for what is no solid, and for polyhedra, whose faces stand beside them.
const FacesOfSolid& faces_of(CellType type);

}  // namespace maille
