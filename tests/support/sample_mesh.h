#pragma once

#include <maille/mesh.h>

namespace maille::testing {

/// The mesh that VTK 9.1 and meshio 5 wrote into the files of tests/formats: 16 points; two triangles,
/// tetrahedra and hexahedra, a wedge and a pyramid as one mixed block; point arrays "temperature" and
/// "velocity", cell array "id".
Mesh sample_mesh();
/// The same with a block per type.
Mesh sample_mesh_by_type();

/// Path of a file of tests/formats.
std::string sample_path(const std::string& name);

}  // namespace maille::testing
