#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace maille {

/// Some cells of a mesh, and the points that they use, as a mesh of their own.
struct CutOut {
  Mesh mesh;                     ///< all blocks, also those that have no cells now
  std::vector<uint32_t> points;  ///< by point, its number in the whole mesh; rising
};

/// `all`: all arrays in their order, and the metadata; `elements`: arrays on points and cells only.
enum class CutArrays : uint8_t { all, elements };

/// `cells`: their numbers through all blocks, rising. They, and the points that they use, keep their order.
/// Takes an eighth of a byte a point of the whole mesh, so cutting many small parts costs time for each.
CutOut cut_out(const Mesh& mesh, std::span<const uint32_t> cells, CutArrays arrays);

/// A block of the same name and type that append_cell() adds cells to. What the block lacks (types, offsets,
/// faces) stays empty, so that validate() takes the copy as it took the original.
CellBlock without_cells(const CellBlock& block);
void append_cell(const CellBlock& from, uint64_t i, CellBlock& to);

/// Some tuples of an array, in the order given; numbers may come again. All are below the array's count.
Array taken(const Array& from, std::span<const uint32_t> tuples);

}  // namespace maille
