#pragma once

#include <maille/ranks.h>

#include <cstdint>
#include <span>
#include <vector>

#include "volume/pieces/cut_rules.h"
#include "volume/pieces/number_cut.h"

namespace maille {

/// The pieces of cut_cells(), found by ranks that each have some of the cells: the very same cuts, however
/// the cells are spread over ranks.
struct RankPieces {
  std::vector<uint32_t> of_cell;  ///< by cell of this rank, in the order given
  uint32_t count = 0;             ///< of all ranks; none where there are no cells
};
/// `reach`: of most cells of all ranks.
RankPieces cut_among_ranks(const std::vector<Middle>& cells, const CutPosition& reach, uint64_t target,
                           Ranks& ranks);

/// What the cells and points of all ranks are in the pieces that stand for all (number_cut.h); the same in
/// all ranks. `points`: by point of the part its number in the whole mesh.
LookedAt look_among_ranks(const Mesh& part, const RankPieces& pieces, std::span<const uint32_t> points,
                          Ranks& ranks);

}  // namespace maille
