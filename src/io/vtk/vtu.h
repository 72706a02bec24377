#pragma once

#include <maille/io.h>
#include "io/cell_store.h"

namespace maille {

Result<ReadResult> read_vtu(const Source& source, const ReadOptions& options);
Result<std::vector<std::string>> write_vtu(const Mesh& mesh, Sink& sink, const WriteOptions& options);

// How a mesh of several blocks is kept in a VTU file: names of arrays in FieldData.

/// Per block: number of cells and VTK type, 255 for mixed (integers, 2 components).
inline constexpr char vtu_blocks_name[] = "maille_blocks";
/// Their names, where at least one has one.
inline constexpr char vtu_block_names_name[] = "maille_block_names";
/// Whether a reader could not tell the blocks from the cells.
bool vtk_needs_blocks(const Mesh& mesh);
bool vtk_has_block_names(const Mesh& mesh);
Array vtk_block_sizes(const Mesh& mesh);
std::vector<std::string> vtk_block_names(const Mesh& mesh);
/// What the two say (`names` may be empty); nothing when they do not belong together.
std::vector<NamedRun> vtk_block_shapes(const Array& sizes, const std::vector<std::string>& names);

/// The cell array that tells VTK's users the names, and the attribute of its tag: readers that have the above
/// leave it out.
inline constexpr char vtu_block_array_name[] = "block";
inline constexpr char vtu_block_mark[] = "maille_block_names";

}  // namespace maille
