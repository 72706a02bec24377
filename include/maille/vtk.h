#pragma once

#include <maille/mesh_source.h>
#include <optional>
#include <string>
#include <utility>
#include <vector>

// How data of VTK hold what VTK itself has no place for: readers and writers of VTK's files and the VTK
// module agree here.

namespace maille {

/// Arrays in the field data: of each block the number of cells and VTK's type, 255 for mixed (integers, 2
/// components), and the names, where at least one has one.
inline constexpr char vtk_blocks_name[] = "maille_blocks";
inline constexpr char vtk_block_names_name[] = "maille_block_names";
/// The labels of an array NAME stand in the field data as NAME_labels.
inline constexpr char vtk_labels_suffix[] = "_labels";
/// The cell array that tells VTK's users of which block a cell is; its labels are the names.
inline constexpr char vtk_block_array_name[] = "block";
/// Metadata: what was text in the VTK data the mesh came from, a line for each ("cell NAME"; "mesh NAME" is
/// metadata or an array on the mesh). It becomes text again. Texts that are not in the list have other
/// sources (names of blocks, labels, comments of PLY files).
inline constexpr char vtk_text_key[] = "vtk.text";

using VtkBlocks = std::vector<MeshDescription::Block>;

/// Whether a reader could not tell the blocks from the cells: one block without a name needs no word.
bool vtk_needs_blocks(const VtkBlocks& blocks);
/// The blocks of a mesh that a reader could not tell from the cells; empty where it can.
VtkBlocks vtk_needed_blocks(const Mesh& mesh);
bool vtk_has_names(const VtkBlocks& blocks);
/// What `vtk_blocks_name` and `vtk_block_names_name` hold.
Array vtk_block_sizes(const VtkBlocks& blocks);
std::vector<std::string> vtk_block_names(const VtkBlocks& blocks);
/// The cell array of `vtk_block_array_name`; nothing where no block has a name, or the mesh has such an
/// array.
std::optional<Array> vtk_block_array(const Mesh& mesh);

/// Whether this was text in the VTK data that the mesh came from.
bool was_vtk_text(const std::vector<std::pair<std::string, std::string>>& metadata, Domain domain,
                  const std::string& name);
/// Whether the array becomes text again: it was text, and each number has its label.
bool is_vtk_text(const std::vector<std::pair<std::string, std::string>>& metadata, const Array& array);
/// The texts of an array that was text, `components` for each tuple; nothing where a number has no label.
std::vector<std::string> vtk_texts_of(const Array& array);

/// The cell arrays of vtkPolyData, in the order of its cells.
enum class VtkPolyKind : uint8_t { verts, lines, polys, strips };
/// Where a cell goes; nothing for solids, curved cells, and pixels, whose nodes are in another order.
std::optional<VtkPolyKind> vtk_poly_kind(CellType type);

}  // namespace maille
