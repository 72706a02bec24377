#pragma once

#include <maille/ranks.h>

#include "volume/pieces/piece_coder.h"
#include "volume/ranks/directory.h"
#include "volume/ranks/part_layout.h"

namespace maille {

/// How numbers are written in all pieces, the same in all ranks: chosen by the first rank from all numbers,
/// in their order, or from every so many where an array is larger than `sample_bytes`. With all numbers at
/// hand these are the maps that one process would choose. Error: usage.
Result<ArrayMapsList> choose_maps_among_ranks(const RankPart& part, const PartLayout& layout,
                                              const PointDirectory& points, const Directory& cells,
                                              const StreamOptions& stream, uint64_t sample_bytes,
                                              Ranks& ranks);

}  // namespace maille
