#include "volume/cell_stencil.h"

#include <algorithm>

namespace maille {

// In a sweep the frames of neighbouring cells agree, so "the neighbour of A across face g" is the cell across
// the edge of A and B. Where they do not agree, a wrong cell is asked, and the choice by error passes the sum
// over. Slots may have been taken by other cells since; both sides see the same.
void CellStencils::find(const CodedCells& cells, size_t i, PointStencil& stencil) {
  stencil.clear();
  const uint32_t slot = cells.cell_slots[i];
  if (slot == no_slot) return;
  const auto& neighbours = cells.across[i];
  std::array<uint32_t, axes> cell{};
  std::array<unsigned, axes> face{};
  unsigned count = 0;
  for (unsigned f = 0; f < most_faces; ++f) {
    const bool same_axis = f % 2 == 1 && neighbours[f - 1] != no_slot;
    if (neighbours[f] == no_slot || same_axis || count == axes) continue;
    cell[count] = neighbours[f];
    face[count++] = f;
  }
  for (unsigned k = 0; k < count; ++k) stencil.near[stencil.near_count++] = cell[k] + 1;
  // A + B + C - AB - AC - BC + ABC, and its analogues for one and two neighbours.
  if (count > 0) {
    PointSum& sum = stencil.add_sum();
    for (unsigned k = 0; k < count; ++k) sum.add(cell[k] + 1, 1);
    bool whole = true;
    for (unsigned a = 0; a < count; ++a) {
      for (unsigned b = a + 1; b < count; ++b) {
        const uint32_t both = across(cell[a], face[b]);
        whole = whole && both != no_slot;
        if (whole) sum.add(both + 1, -1);
      }
    }
    const uint32_t all = count == 3 && whole ? across(across(cell[0], face[1]), face[2]) : no_slot;
    if (count == 3 && all != no_slot) sum.add(all + 1, 1);
    if (!whole || (count == 3 && all == no_slot)) {
      stencil.sums = 0;
    }
  }
  if (count > 0) {
    PointSum& mean = stencil.add_sum();
    for (unsigned k = 0; k < count; ++k) mean.add(cell[k] + 1, 1.0 / count);
    PointSum& first = stencil.add_sum();
    first.add(cell[0] + 1, 1);
  }
  if (count > 0)
    stencil.situation = static_cast<uint8_t>(PointStencil::partial + 4 * (stencil.sums - 1) + count);
  if (slot >= links_.size())
    links_.resize(slot + size_t{slot} / 2 + 16, [] {
      std::array<uint32_t, most_faces> none;
      none.fill(no_slot);
      return none;
    }());
  links_[slot] = neighbours;
}

}  // namespace maille
