#pragma once

#include <maille/folder.h>
#include <maille/mesh_source.h>

#include <span>
#include <string>
#include <vector>

#include "io/foam/foam_file.h"

namespace maille {

// What is common to reading OpenFOAM's polyMesh whole (polymesh.cpp) and in parts (polymesh_source.cpp).

/// A patch: a range of faces at the boundary, and what the file "boundary" says of it.
struct FoamPatch {
  std::string name, type;
  uint64_t first = 0, faces = 0;
  std::string entries = {};  ///< others, such as the neighbour of a cyclic one: "neighbourPatch left; ..."
};
Result<std::vector<FoamPatch>> read_foam_patches(FoamReader& boundary);
/// In the description of a mesh, the type of a patch stands behind this and its name.
inline constexpr char foam_patch_prefix[] = "openfoam.patch.";

/// ... and behind this one its other entries, where it has any.
inline constexpr char foam_entries_prefix[] = "openfoam.entries.";
/// Whether text consists of words, numbers and lists, and so means nothing but itself to OpenFOAM: other text
/// could include files or run code.
bool is_plain_entries(std::string_view text);
void add_foam_metadata(const FoamPatch& patch, std::vector<std::pair<std::string, std::string>>& metadata);

/// The faces of a cell, one after the other, each seen from outside.
struct FoamFaces {
  std::vector<uint32_t> corners, sizes;

  void clear() {
    corners.clear();
    sizes.clear();
  }
  /// Adds a face. Seen from the cell it belongs to it stays; from its neighbour it is turned over, and keeps
  /// its first corner.
  void add(std::span<const uint32_t> face, bool turned);
};

struct FoamCell {
  CellType type = CellType::polyhedron;
  std::vector<uint32_t> nodes;
};
/// Makes a tetrahedron, hexahedron, wedge or pyramid, if the faces are exactly those of one, else a
/// polyhedron of these faces.
void make_foam_cell(const FoamFaces& faces, FoamCell& cell);

/// The type that all these faces can have as cells: triangles, quads, else polygons.
class FoamPatchType {
 public:
  void add(size_t size) {
    triangles_ = triangles_ && size == 3;
    quads_ = quads_ && size == 4;
  }
  CellType type() const {
    return triangles_ ? CellType::triangle : quads_ ? CellType::quad : CellType::polygon;
  }

 private:
  bool triangles_ = true, quads_ = true;
};

/// Writes a mesh in memory. The sink has to be a folder: polymesh_sink().
Result<std::vector<std::string>> write_polymesh(const Mesh& mesh, Sink& sink, const WriteOptions& options);

/// Reads the mesh in parts, and sorts its faces out of core. `memory`: bytes, about; `folder`: of temporary
/// files.
Result<std::vector<std::string>> write_polymesh(MeshSource& mesh, FolderSink& sink, bool ascii,
                                                uint64_t memory, const std::string& folder);

/// A case with the fields of one of its times (foam_times_of()).
Result<ReadResult> read_foam_step(const std::string& case_folder, const ReadOptions& options, uint64_t step);

/// The folder with the mesh, of a file in it, of a case's ".foam" file, or of the case.
std::string foam_folder_of(const std::string& name);

}  // namespace maille
