#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <vector>

namespace maille::testing {

/// Cells of all dimensions. A function, as GCC 12 takes a list among the options for uninitialized.
std::vector<CellType> all_volume_types();

struct RandomVolumeOptions {
  /// Types of cells; polyhedra among them have faces.
  std::vector<CellType> types = all_volume_types();
  bool mixed = true;  ///< blocks of type mixed
  bool names = true;  ///< of blocks
  bool several_blocks = true;
  bool arrays = true;  ///< on points, cells and the mesh
  bool corner_arrays = true;
  bool special_values = true;  ///< NaN payloads, infinities; otherwise numbers that text of any kind keeps
  Scalar position = Scalar::f64;
};

/// A soup of cells over random points: valid, not geometrically sensible.
Mesh random_volume(uint64_t seed, const RandomVolumeOptions& options = {});

}  // namespace maille::testing
