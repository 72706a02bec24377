#pragma once

#include <algorithm>

#include "entropy/static_rans.h"
#include "surface/fans/fan_machine.h"
#include "surface/fans/fan_tables.h"

namespace maille {

/// The decoder's side of a FanMachine: it reads numbers where an encoder's side would find them.
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

/// Entries that the fast loop may write behind the ring before room is looked for again: 168 symbols. Chosen,
/// not swept; vertices of as many entries must also fit most_ahead, and their triangles half of a piece
/// (fan_decoder.cpp).
inline constexpr uint32_t fast_room = 1 << 9;
/// Rings of the fast loop: the two vertices behind the head are others than the last one.
inline constexpr std::ptrdiff_t least_fast_ring = 4;
/// What the loop writes beyond what there is, harmlessly: vertices, and corners.
inline constexpr size_t spare_vertices = 4;

/// Decodes the symbols close and pocket with at most three new vertices, as long as they come (nine in ten),
/// without branches, with swallow and rare ones in between. It does for them what FanMachine::apply() does,
/// and returns at any symbol that is not for it, without having read that. False: a marker was taken for a
/// vertex, there are more vertices than announced, or a rare symbol cannot be.
bool run_fast(FanMachine<FanReader>& machine, FanReader& reader, FanSurface& out);

}  // namespace maille
