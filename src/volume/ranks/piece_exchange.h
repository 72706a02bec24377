#pragma once

#include <maille/ranks.h>

#include <cstdint>
#include <vector>

#include "volume/pieces/sub_mesh.h"
#include "volume/ranks/directory.h"
#include "volume/ranks/part_layout.h"

namespace maille {

/// A piece in the rank that codes it, complete: its cells, and all values of its points.
struct PieceOfRank {
  uint32_t number = 0;
  SubMesh sub;
  std::vector<uint32_t> cells;   ///< their numbers, rising; none: the points that no cell uses
  std::vector<uint32_t> shared;  ///< numbers of points that other pieces have, too, rising
};

/// Who codes a piece of so many: neighbours in the list go to one rank, so that each rank writes one stretch
/// of the file. Ranks get the same number of pieces but for one.
inline unsigned rank_of_piece(uint32_t piece, uint32_t pieces, unsigned ranks) {
  return static_cast<unsigned>(uint64_t{piece} * ranks / pieces);
}

/// How the cells of this rank are divided.
struct Division {
  std::vector<uint32_t> numbers;  ///< by cell of the part, in the whole mesh
  std::vector<uint32_t> pieces;   ///< by cell of the part, its piece
  uint32_t count = 0;             ///< of all ranks, of cells and of points without cells
  bool has_unused = false;        ///< the last piece is one of points
};

/// Brings cells to the ranks of their pieces, and the values of their points; all ranks together. Returns the
/// pieces of this rank, by number. Three exchanges, and one more where points have no cells.
std::vector<PieceOfRank> exchange_pieces(const RankPart& part, const PartLayout& layout,
                                         const PointDirectory& points, const Division& division,
                                         Ranks& ranks);

}  // namespace maille
