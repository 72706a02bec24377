#pragma once

#include <maille/mesh_source.h>

namespace maille {

// What open_mesh_source() chooses from, by the first bytes.

Result<std::unique_ptr<MeshSource>> open_vtu_source(const Source& source, const Limits& limits);
Result<std::unique_ptr<MeshSource>> open_gmsh_source(const Source& source, const Limits& limits);
Result<std::unique_ptr<MeshSource>> open_ply_source(const Source& source, const Limits& limits);
/// Version 2.2, binary. Tags have to be written before their cells. Error: unsupported, for what only the
/// writer of whole meshes can do.
Result<std::unique_ptr<MeshSink>> gmsh_sink(const std::string& path, const MeshDescription& description);

/// Any version, binary or text, through temporary files. Error: unsupported, for numbers of nodes and
/// elements.
Result<std::unique_ptr<MeshSink>> spooled_gmsh_sink(const std::string& path,
                                                    const MeshDescription& description,
                                                    const MeshSinkOptions& options);

/// A folder, through temporary files.
Result<std::unique_ptr<MeshSink>> spooled_polymesh_sink(const std::string& path,
                                                        const MeshDescription& description,
                                                        const MeshSinkOptions& options);

}  // namespace maille
