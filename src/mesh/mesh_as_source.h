#pragma once

#include <maille/mesh_source.h>

namespace maille {

/// A mesh in memory for what takes meshes in parts. Arrays on corners are left out. The mesh must outlive it.
std::unique_ptr<MeshSource> mesh_as_source(const Mesh& mesh);

}  // namespace maille
