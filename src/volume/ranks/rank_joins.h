#pragma once

#include <maille/ranks.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "volume/pieces/piece_coder.h"
#include "volume/ranks/piece_exchange.h"

namespace maille {

/// What a piece has in common with others.
struct PieceJoin {
  uint32_t piece = 0;
  std::vector<uint32_t> shared;  ///< numbers of points, rising
  std::vector<Place> places;     ///< of these, where positions are exact
};
/// Before pieces are coded.
std::vector<PieceJoin> joins_of(const std::vector<PieceOfRank>& pieces);

/// Tells pieces apart points of one place, which the first rank does for all, and codes what they share.
/// `pieces`: of all ranks.
void join_among_ranks(const std::vector<PieceJoin>& joins, uint32_t pieces, std::vector<PieceInWork>& coded,
                      Ranks& ranks);

}  // namespace maille
