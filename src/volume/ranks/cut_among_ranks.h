#pragma once

#include <maille/ranks.h>

#include <array>
#include <cstdint>
#include <vector>

namespace maille {

/// A cell as cuts see it.
struct CellMiddle {
  std::array<float, 3> at{};
  uint32_t number = 0;  ///< in the whole mesh
};

/// The pieces of cut_cells(), found by ranks that each have some of the cells.
struct RankPieces {
  std::vector<uint32_t> of_cell;  ///< by cell of this rank, in the order given
  uint32_t count = 0;             ///< of all ranks; none where there are no cells
};
RankPieces cut_among_ranks(const std::vector<CellMiddle>& cells, uint64_t target, Ranks& ranks);

}  // namespace maille
