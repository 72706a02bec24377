#pragma once

#include <maille/random_access.h>

#include <cstdint>
#include <optional>

#include "random/chart_index.h"

namespace maille {

/// Is what replaces the charts of a group too coarse for `detail`?
bool is_too_coarse(const IndexedGroup& group, const Detail& detail);

/// The charts of the cut that `detail` asks for, as far as they meet the region. Visits only groups that meet
/// it.
Selection select(const ChartIndex& index, const Region& region, const Detail& detail);

/// The finest cut of at most so many faces: refines what looks worst first (by `view`, else by error in world
/// units). Faces of charts outside the region do not count and do not come.
Selection select_within(const ChartIndex& index, const Region& region, uint64_t most_faces,
                        const std::optional<View>& view = {});

}  // namespace maille
