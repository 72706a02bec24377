#pragma once

#include <maille/mesh_source.h>

namespace maille {

// What open_mesh_source() chooses from, by the first bytes.

Result<std::unique_ptr<MeshSource>> open_vtu_source(const Source& source, const Limits& limits);
Result<std::unique_ptr<MeshSource>> open_gmsh_source(const Source& source, const Limits& limits);

}  // namespace maille
