#pragma once

#include <maille/io.h>
#include <maille/vtk.h>
#include "io/cell_store.h"

namespace maille {

Result<ReadResult> read_vtu(const Source& source, const ReadOptions& options);
Result<std::vector<std::string>> write_vtu(const Mesh& mesh, Sink& sink, const WriteOptions& options);

/// The blocks that vtk_block_sizes() and vtk_block_names() say (the second may be empty); nothing when they
/// do not belong together. Sizes come from a file: CellStore::fits() must look at them before use.
std::vector<NamedRun> vtk_block_shapes(const Array& sizes, const std::vector<std::string>& names);

/// Says that VTK has a number for Lagrange pyramids, but (9.1) no class, so it reads them and shows nothing.
void note_pyramids(uint64_t lagrange, std::vector<std::string>& notes);
uint64_t count_lagrange_pyramids(const Mesh& mesh);

/// The attribute of the tag of vtk_block_array_name: readers that have the blocks leave the array out.
inline constexpr char vtu_block_mark[] = "maille_block_names";

}  // namespace maille
