#pragma once

#include <maille/mesh.h>

#include <string>

#include "summary.h"

// What `info` says of meshes in other formats.
namespace maille::tool {

/// How the faces of a surface meet at their edges. Cells that are no faces are not counted.
struct EdgeCounts {
  uint64_t faces = 0;
  uint64_t edges = 0;    ///< of faces, each once
  uint64_t border = 0;   ///< with one face
  uint64_t crowded = 0;  ///< with more than two
  uint64_t turned = 0;   ///< with two faces that pass it in the same direction
  bool is_closed() const { return faces > 0 && border == 0 && crowded == 0 && turned == 0; }
};
/// Takes 8 bytes for each side of a face, and sorts them.
EdgeCounts count_edges(const Mesh& mesh);

/// `bytes`: of the file, or of all files of a folder.
std::string mesh_info_text(const Mesh& mesh, const std::string& name, const std::string& format,
                           uint64_t bytes);
Json mesh_info_json(const Mesh& mesh, const std::string& name, const std::string& format, uint64_t bytes);

}  // namespace maille::tool
