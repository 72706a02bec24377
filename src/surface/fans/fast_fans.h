#pragma once

#include <algorithm>

#include "entropy/static_rans.h"
#include "surface/fans/fan_machine.h"
#include "surface/fans/fan_tables.h"

namespace maille {

/// The decoder's side of a FanMachine.
class FanReader {
 public:
  static constexpr bool encoding = false;

  FanReader(Bytes events, const FanSlots& tables) : rans(events), slots(tables) {}

  uint32_t number(FanNumber kind, uint32_t, uint32_t = 0) {
    const unsigned symbol = rans.get(slots.table_of(kind));
    if (symbol < direct_numbers) return symbol;
    const unsigned count = symbol - direct_numbers + 3;
    const unsigned low = std::min(count, 16u);
    uint32_t bits = rans.get_raw(low);
    if (count > 16) bits |= rans.get_raw(count - 16) << 16;
    return (1u << count) + bits;
  }

  StaticRansDecoder rans;
  const FanSlots& slots;
};

/// Entries that the fast loop may write behind the ring before it looks for room again.
inline constexpr uint32_t fast_room = 1 << 9;
/// Rings of the fast loop: the two vertices behind the head are others than the last one.
inline constexpr std::ptrdiff_t least_fast_ring = 4;
/// What the loop writes beyond what there is, harmlessly: vertices, and corners.
inline constexpr size_t spare_vertices = 4;

/// The symbols close and pocket with at most three new vertices, as long as they come: nine in ten, without
/// branches; swallow, and rare ones, in between. What FanMachine::apply() does for them.
/// False: a marker was taken for a vertex, there are too many of these, or a rare symbol cannot be.
bool run_fast(FanMachine<FanReader>& machine, FanReader& reader, FanSurface& out);

}  // namespace maille
