#pragma once

#include <maille/io.h>

#include "io/gltf/gltf_scene.h"

// 3MF, the packages that people print: a ZIP archive with an XML model of triangles (3MF Core
// Specification 1.3, 3mf.io). Objects become blocks, base materials the label array "material". Where the
// build has objects several times or turned, instances stand in the metadata that glTF files have
// ("gltf.nodes", "gltf.scene", "gltf.meshes"), so scenes are applied, and written to glTF, in the same way.
namespace maille {

/// What the paths of a package are, and the namespace of the core.
inline constexpr const char* threemf_model_path = "3D/3dmodel.model";
inline constexpr const char* threemf_core = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
inline constexpr const char* threemf_relation =
    "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";

/// Number `i` of the 12 of a transform: four rows of three, a point is a row to their left. The same numbers
/// in the same order are the columns of glTF's matrices without their last row.
auto& threemf_number(auto& affine, size_t i) {
  return affine.m[i % 3][i / 3];
}

Result<ReadResult> read_threemf(const Source& source, const ReadOptions& options);
Result<std::vector<std::string>> write_threemf(const Mesh& mesh, Sink& sink, const WriteOptions& options);

}  // namespace maille
