#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace maille {

/// Where in a mesh that was read from polyMesh values of OpenFOAM's fields go. Fields on cells: to the cells,
/// values at patches to the faces of these, which are cells, too. Fields on faces: those inside go to the
/// cell that owns them, one component (or more) for each; those of patches to the patches' faces. Spans point
/// into the reader's lists.
struct FoamPlaces {
  struct Patch {
    std::string name, type;
    uint64_t first = 0;  ///< of its faces, among all cells
    uint64_t faces = 0;
    std::span<const uint64_t> owners = {};  ///< the cells that the faces belong to
  };
  std::string mesh;  ///< for messages
  uint64_t points = 0, cells = 0, all_cells = 0;
  std::vector<Patch> patches;
  std::span<const uint64_t> owners;  ///< of the faces inside, in their order
  /// The most faces inside that one cell owns. 0: the faces are not in the order of OpenFOAM, by owner and
  /// neighbour, in which they are written again.
  uint64_t most_owned = 0;

  const Patch* find(const std::string& name) const {
    for (const Patch& patch : patches) {
      if (patch.name == name) return &patch;
    }
    return nullptr;
  }
};

/// FoamPlaces::most_owned of faces inside with these cells on their sides. Only faces in OpenFOAM's order (by
/// owner, then neighbour, owner below neighbour) can be found again by counting.
inline uint64_t most_owned_faces(std::span<const uint64_t> owners, std::span<const uint64_t> neighbours) {
  uint64_t most = 0, owned = 0;
  for (size_t i = 0; i < owners.size(); ++i) {
    const bool same = i > 0 && owners[i] == owners[i - 1];
    const bool rises = i == 0 || owners[i] > owners[i - 1] || (same && neighbours[i] >= neighbours[i - 1]);
    if (!rises || owners[i] >= neighbours[i]) return 0;
    owned = same ? owned + 1 : 1;
    most = owned > most ? owned : most;
  }
  return most;
}

}  // namespace maille
