#pragma once

#include <maille/mesh.h>

#include <span>
#include <vector>

#include "random/build/spatial_graph.h"
#include "surface/parts/shared_points.h"

namespace maille {

/// Where values jump: what coarser levels need to know so that corners and faces keep theirs.
struct Seams {
  std::vector<uint32_t> values;    ///< by corner: corners at one place with one number have the same values
  std::vector<uint32_t> point_of;  ///< by point: the lowest one at the same place with the same values
};

/// Empty where all faces at a place have the same values: no arrays of cells or corners, and no points that
/// are at one place but differ. An array that jumps at more than half of all places (one that numbers the
/// faces, normals of flat faces) has no seams: all would be held. `places`: by point, as decoded.
Seams find_seams(const Mesh& mesh, const FaceLists& faces, std::span<const Place> places);

}  // namespace maille
