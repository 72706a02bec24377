#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <vector>

namespace maille::testing {

struct RandomVolumeOptions {
  /// Types of cells; polyhedra among them have faces.
  std::vector<CellType> types = {CellType::tetrahedron,
                                 CellType::hexahedron,
                                 CellType::wedge,
                                 CellType::pyramid,
                                 CellType::triangle,
                                 CellType::quad,
                                 CellType::line,
                                 CellType::vertex,
                                 CellType::polygon,
                                 CellType::poly_line,
                                 CellType::polyhedron,
                                 CellType::quadratic_tetrahedron,
                                 CellType::quadratic_hexahedron,
                                 CellType::quadratic_wedge,
                                 CellType::quadratic_pyramid,
                                 CellType::quadratic_triangle,
                                 CellType::biquadratic_quad,
                                 CellType::triquadratic_hexahedron,
                                 CellType::biquadratic_quadratic_wedge,
                                 CellType::voxel,
                                 CellType::lagrange_hexahedron,
                                 CellType::poly_vertex,
                                 CellType::convex_point_set};
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
