#pragma once

#include <maille/mesh_source.h>

namespace maille {

/// Opens a surface of any size for reading in parts: binary PLY as open_mesh_source() does; PLY as text,
/// binary STL and OBJ by way of a temporary file that takes about as much room as the mesh, so that opening
/// takes a pass or two over them. OBJ: positions (with colours), faces, normals and texture coordinates that
/// are those of the points; STL is welded bit for bit. What read_mesh() makes of the file is what is read
/// here. `source` must outlive the result. Error: unsupported, naming what stands in the way.
[[nodiscard]] Result<std::unique_ptr<MeshSource>> open_surface_source(const Source& source,
                                                                      const PartsOptions& options = {});

}  // namespace maille
