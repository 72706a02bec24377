#include "volume/values/cell_stencil.h"

#include <algorithm>

#include "volume/cells/slots.h"

namespace maille {

/// The other seven around a corner of eight cells: A, B, C, AB, AC, BC, ABC.
bool CellStencils::find_others(const std::array<uint32_t, axes>& cell, const std::array<unsigned, axes>& face,
                               PointStencil& stencil) const {
  const uint32_t ab = across(cell[0], face[1]), ac = across(cell[0], face[2]), bc = across(cell[1], face[2]);
  const uint32_t abc = ab == no_slot ? no_slot : across(ab, face[2]);
  if (ac == no_slot || bc == no_slot || abc == no_slot) return false;
  stencil.others = {cell[0] + 1, cell[1] + 1, cell[2] + 1, ab + 1, ac + 1, bc + 1, abc + 1};
  return true;
}

/// Where fewer than seven are known: A + B - AB, if there are just two and AB; the mean; A. The choice by
/// record finds out which serves.
void CellStencils::add_sums(std::span<const uint32_t> cell, const std::array<unsigned, axes>& face,
                            PointStencil& stencil) const {
  const uint32_t both = cell.size() == 2 ? across(cell[0], face[1]) : no_slot;
  if (both != no_slot) {
    PointSum& sum = stencil.add_sum();
    sum.add(cell[0] + 1, 1);
    sum.add(cell[1] + 1, 1);
    sum.add(both + 1, -1);
  }
  PointSum& mean = stencil.add_sum();
  for (const uint32_t each : cell) mean.add(each + 1, 1.0 / static_cast<double>(cell.size()));
  stencil.add_sum().add(cell[0] + 1, 1);
}

// In a sweep the frames of neighbouring cells agree, so "the neighbour of A across face g" is the cell across
// the edge of A and B. Where they do not agree, a wrong cell is asked, and the choice by error passes the sum
// over. Slots may have been taken by other cells since; both sides see the same.
void CellStencils::find(const CodedCells& cells, size_t i, PointStencil& stencil) {
  stencil.clear();
  const uint32_t slot = cells.cell_slots[i];
  if (slot == no_slot) return;
  // Faces of a polyhedron have no opposites, so that its neighbours say nothing about cells across edges.
  if (cells.kinds[i] == face_cell) {
    find_mean(cells.across[i], stencil);
    put_links(slot, no_links());
    return;
  }
  const auto& neighbours = cells.across[i];
  std::array<uint32_t, axes> cell{};
  std::array<unsigned, axes> face{};
  unsigned count = 0;
  // One neighbour for each axis: faces 2k and 2k + 1 are opposite in hexahedra (cell_shape.cpp). In other
  // solids pairs mean nothing, and the choice is merely fixed.
  for (unsigned f = 0; f < most_faces; ++f) {
    const bool same_axis = f % 2 == 1 && neighbours[f - 1] != no_slot;
    if (neighbours[f] == no_slot || same_axis || count == axes) continue;
    cell[count] = neighbours[f];
    face[count++] = f;
  }
  for (unsigned k = 0; k < count; ++k) stencil.near[stencil.near_count++] = cell[k] + 1;
  if (count == axes && find_others(cell, face, stencil)) {
    stencil.situation = PointStencil::full;
  } else if (count > 0) {
    add_sums(std::span(cell).first(count), face, stencil);
    stencil.situation = static_cast<uint8_t>(PointStencil::partial + 4 * (stencil.sums - 1) + count);
  }
  put_links(slot, neighbours);
}

/// Of a polyhedron: the mean of its neighbours, and one of them.
void CellStencils::find_mean(const std::array<uint32_t, most_faces>& neighbours, PointStencil& stencil) {
  unsigned count = 0;
  while (count < most_faces && neighbours[count] != no_slot) ++count;
  if (count == 0) return;
  for (unsigned k = 0; k < count && k < axes; ++k) stencil.near[stencil.near_count++] = neighbours[k] + 1;
  PointSum& mean = stencil.add_sum();
  for (unsigned k = 0; k < count; ++k) mean.add(neighbours[k] + 1, 1.0 / count);
  stencil.add_sum().add(neighbours[0] + 1, 1);
  stencil.situation = static_cast<uint8_t>(PointStencil::partial + 4 + stencil.near_count);
}

CellStencils::Links CellStencils::no_links() {
  Links none;
  none.fill(no_slot);
  return none;
}

void CellStencils::put_links(uint32_t slot, const Links& links) {
  if (slot >= links_.size()) links_.resize(rows_for(slot), no_links());
  links_[slot] = links;
}

}  // namespace maille
