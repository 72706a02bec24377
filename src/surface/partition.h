#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace maille {

/// Where the elements of a part are in the whole mesh.
struct PartNumbers {
  std::vector<uint32_t> points;        ///< by point
  std::vector<uint32_t> cells;         ///< by cell, counted over all blocks
  std::vector<uint32_t> first_corner;  ///< by cell: its first corner
};

/// A part of a mesh that is coded by itself: its cells in the order of the whole, its points numbered anew in
/// that order. Points on the cut are in every part that meets there.
struct MeshPart {
  Mesh mesh;  ///< the blocks of the whole, some of them empty; positions; no other arrays
  PartNumbers numbers;
};

/// Cuts a mesh of more than `most_cells` cells along planes until no part has more: each cut halves the cells
/// along the longest side of their box. `positions` are three for each point, as the decoder will have them;
/// then the parts depend only on the set of cells, so that a decoded mesh is cut the same way again. Cells in
/// one place are never separated. Gives the part of each cell; the number of parts is one more than the
/// highest.
std::vector<uint32_t> partition_cells(const Mesh& mesh, std::span<const float> positions,
                                      uint64_t most_cells);

/// The parts that `part_of` names, by cell. Points without a cell belong to part 0.
std::vector<MeshPart> take_parts(const Mesh& mesh, std::span<const uint32_t> part_of);

}  // namespace maille
