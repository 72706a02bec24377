#pragma once

#include <maille/ranks.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "volume/pieces/piece_coder.h"
#include "volume/ranks/piece_exchange.h"

namespace maille {

/// What a piece has in common with others, kept while the piece itself is coded and gone.
struct PieceJoin {
  uint32_t piece = 0;
  std::vector<uint32_t> shared;  ///< numbers of points, rising
  std::vector<Place> places;     ///< of these, where positions are exact
};
/// Taken before pieces are coded, as coding takes their meshes.
std::vector<PieceJoin> joins_of(const std::vector<PieceOfRank>& pieces);

/// Tells points of one place apart, which the first rank does for all, and codes what each piece shares.
/// `pieces`: of all ranks. The first rank has some 30 bytes for each shared point of each piece: surfaces of
/// pieces, not their volumes.
void join_among_ranks(const std::vector<PieceJoin>& joins, uint32_t pieces, std::vector<PieceInWork>& coded,
                      Ranks& ranks);

}  // namespace maille
