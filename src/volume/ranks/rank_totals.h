#pragma once

#include <maille/ranks.h>

#include "volume/pieces/piece_coder.h"
#include "volume/ranks/directory.h"
#include "volume/ranks/part_layout.h"

namespace maille {

/// What is known of the mesh of all ranks, in all of them: tail and report as one process would make them, up
/// to what coding adds.
struct RankTotals {
  StreamTail tail;      ///< without pieces and errors
  EncodeReport report;  ///< without what is coded
};
/// All ranks together.
RankTotals count_among_ranks(const RankPart& part, const PartLayout& layout, const PointDirectory& points,
                             Ranks& ranks);

/// Adds up what the pieces of all ranks took; all get the sum, and the largest errors.
void add_reports_of_ranks(const PieceCoding& coding, Ranks& ranks, EncodeReport& report);

}  // namespace maille
