#pragma once

#include <maille/io.h>

#include <array>
#include <optional>

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

/// Four rows of three numbers; a point is a row to their left. The same numbers in the same order are the
/// columns of glTF's matrices without their last row.
using ThreeMfTransform = std::array<double, 12>;
inline constexpr ThreeMfTransform threemf_identity = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};

Result<ReadResult> read_threemf(const Source& source, const ReadOptions& options);
Result<std::vector<std::string>> write_threemf(const Mesh& mesh, Sink& sink, const WriteOptions& options);

}  // namespace maille
