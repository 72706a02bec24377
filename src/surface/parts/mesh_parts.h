#pragma once

#include <maille/executor.h>
#include <maille/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

#include "description/block_cells.h"

namespace maille {

/// Where the elements of a part are in the whole mesh.
struct PartNumbers {
  std::vector<uint32_t> points;        ///< by point
  std::vector<uint32_t> cells;         ///< by cell, counted over all blocks; if wanted
  std::vector<uint32_t> first_corner;  ///< by cell: its first corner; if wanted
  std::vector<uint32_t> corners;       ///< by corner; empty: those of a cell follow its first one
};

/// A part of a mesh that is coded by itself: its cells in the order of the whole, its points numbered anew in
/// that order. Points on the cut are in every part that meets there.
struct MeshPart {
  Mesh mesh;  ///< the blocks that have cells here; so many points, but no positions or arrays
  std::vector<uint32_t> block_numbers;  ///< by block: its place among those of the whole, rising
  PartNumbers numbers;

  std::vector<BlockCells> cells_by_block() const;
};

/// The parts that a partition names, by cell. Points without a cell belong to part 0. `mesh` must stay.
/// `with_cells`: it is wanted where cells are in the whole mesh, which takes 8 bytes a cell.
class MeshParts {
 public:
  MeshParts(const Mesh& mesh, std::span<const uint32_t> part_of, Executor& executor, bool with_cells = true);

  size_t count() const { return cells_.size(); }
  /// Each part can be taken once; several of them at once.
  MeshPart take(size_t part);

 private:
  const Mesh& mesh_;
  // By block: those of all blocks before it; then of all.
  std::vector<uint64_t> cells_before_, corners_before_;
  bool with_cells_;
  std::vector<std::vector<uint32_t>> cells_;  // by part
  std::vector<uint32_t> unused_points_;
};

}  // namespace maille
