#pragma once

#include <maille/mesh_source.h>

namespace maille {

// What open_mesh_source() chooses from, by the first bytes.

Result<std::unique_ptr<MeshSource>> open_vtu_source(const Source& source, const Limits& limits);
Result<std::unique_ptr<MeshSource>> open_gmsh_source(const Source& source, const Limits& limits);
Result<std::unique_ptr<MeshSource>> open_ply_source(const Source& source, const Limits& limits);
/// Gmsh 2.2, binary, written as it comes. Tags have to be written before their cells. Error: unsupported, for
/// what only the writer of whole meshes can do.
Result<std::unique_ptr<MeshSink>> gmsh_sink(const std::string& path, const MeshDescription& description);

/// Gmsh of any version, binary or text, through temporary files. Error: unsupported, for numbers of nodes and
/// elements (they would have to be looked up at random).
Result<std::unique_ptr<MeshSink>> spooled_gmsh_sink(const std::string& path,
                                                    const MeshDescription& description,
                                                    const MeshSinkOptions& options);

/// A folder of OpenFOAM, through temporary files: faces have to be sorted before the first is written. Error:
/// unsupported, for 2^32 points and more.
Result<std::unique_ptr<MeshSink>> spooled_polymesh_sink(const std::string& path,
                                                        const MeshDescription& description,
                                                        const MeshSinkOptions& options);

}  // namespace maille
