// Cells as numbers of points, for meshes whose numbers follow a simpler rule than their cells do. What the
// other stages need, the points in memory and the cells that share faces, follows from the numbers.
#include <algorithm>

#include "volume/cells/cell_coder.h"

namespace maille {

template <class Coder>
bool CellCoder<Coder>::code_by_indices(Coder& topology, Coder& numbers, StreamedCell& cell, CodedCells& out) {
  signature_ = 0;
  find_sources();
  recent_ = hashed(hashed(last_signatures_[0], last_signatures_[1]), last_signatures_[2]);
  cell_.kind = code_kind(topology, cell.kind);
  cell_.known = cell_.fresh = cell_.glued = 0;
  if (damaged_) return false;
  if (cell_.kind >= shape_count) return code_without_shape(topology, numbers, cell, out);
  cell.kind = cell_.kind;
  const auto nodes = std::span(cell.number).first(cell_.shape().nodes);
  if constexpr (encoding) drop_repeated_ends(cell);
  const bool as_before = indices_->code_step(topology, cell.kind, likely_steps(), nodes, cell.final);
  if (!as_before) indices_->code(topology, cell.kind, nodes);
  join_by_numbers(cell);
  number_is_known_ = true;
  create_corners(numbers, cell, out);
  join_extra_nodes(numbers, cell, out);
  number_is_known_ = false;
  if (damaged_) return false;
  enter(cell, out);
  if (!as_before) code_ends(topology, cell);
  cell.final &= (1u << nodes.size()) - 1;  // damaged streams may have more
  hull_.cell(last_.slot).pattern = indices_->finish_cell(cell.kind, nodes, cell.final);
  hull_.cell(last_.slot).signature = signature_;
  if (faces_ && cell_.shape().dimension == 3) faces_->close_under(*this, last_.slot);
  last_signatures_ = {signature_, last_signatures_[0], last_signatures_[1]};
  follow_group(cell);
  remove_final(cell, out);
  return true;
}

/// Corners whose numbers are not in memory are new.
template <class Coder>
void CellCoder<Coder>::join_by_numbers(const StreamedCell& cell) {
  for (unsigned i = 0; i < cell_.shape().corners; ++i) {
    unsigned of = 0;
    while (cell.number[of] != cell.number[i]) ++of;
    const uint32_t slot = of < i ? no_slot : table_.find(cell.number[i], i);
    if (of < i) {
      repeat_of_[i] = static_cast<uint8_t>(of);
      repeated_ |= 1u << i;
      if (cell_.has(of)) cell_.set_corner(i, cell_.corner[of]);
    } else if (slot == no_slot) {
      cell_.fresh |= 1u << i;
    } else {
      cell_.set_corner(i, slot);
    }
  }
  glue_the_rest();
}

template <class Coder>
void CellCoder<Coder>::join_extra_nodes(Coder& numbers, const StreamedCell& cell, CodedCells& out) {
  for (unsigned i = cell_.shape().corners; i < cell_.shape().nodes && !damaged_; ++i) {
    node_[i] = table_.find(cell.number[i], i);
    if (node_[i] != no_slot) continue;
    NewPoint point;
    point.cell = static_cast<uint32_t>(out.size());
    point.node = static_cast<uint8_t>(i);
    point.fresh = static_cast<uint8_t>(cell_.fresh);
    point.slot = node_[i] = create_point(numbers, cell.number[i], false, 0, 33 + i);
    point.number = cell.number[i];
    if (!damaged_) out.points.push_back(point);
  }
}

template <class Coder>
void CellCoder<Coder>::code_ends(Coder& coder, StreamedCell& cell) {
  uint32_t closed = 0;
  for (unsigned i = 0; i < cell_.shape().corners; ++i) closed |= (has_open_face(node_[i]) ? 0u : 1u) << i;
  signature_ = hashed(closed | cell_.glued << 8 | cell_.kind << 16, cell_.fresh);
  code_finals(coder, cell, true);
}

/// Does a face at the point wait for another cell?
template <class Coder>
bool CellCoder<Coder>::has_open_face(uint32_t slot) const {
  return hull_.around(slot, [&](uint32_t cell, uint32_t corner) {
    const Hull::Cell& other = hull_.cell(cell);
    return (other.open & Hull::shape_of(other).faces_at[corner]) != 0;
  });
}

/// A bit for each node that ends; encoder: not those that repeat others.
template <class Coder>
void CellCoder<Coder>::drop_repeated_ends(StreamedCell& cell) const {
  for (unsigned i = 1; i < cell_.shape().nodes; ++i) {
    for (unsigned j = 0; j < i; ++j) {
      if (cell.number[j] == cell.number[i]) cell.final &= ~(1u << i);
    }
  }
}

/// The steps of the cells a row and a layer back, and of the last cell.
template <class Coder>
std::array<uint32_t, 3> CellCoder<Coder>::likely_steps() const {
  std::array<uint32_t, 3> steps;
  steps.fill(IndexCoder<Coder>::no_step);
  uint32_t newest_age = 0xffffffff, oldest_age = 0;
  for (unsigned source = 0; source < source_count; ++source) {
    if (sources_.cell[source] == no_slot) continue;
    const Hull::Cell& other = hull_.cell(sources_.cell[source]);
    if (other.kind != cell_.kind) continue;
    if (source == 0) {
      steps[2] = other.pattern;
      continue;
    }
    const uint32_t age = ordinal_ - other.ordinal;
    if (age < newest_age) steps[0] = other.pattern;
    if (age > oldest_age) steps[1] = other.pattern;
    newest_age = std::min(newest_age, age);
    oldest_age = std::max(oldest_age, age);
  }
  return steps;
}

template bool CellCoder<RangeEncoder>::code_by_indices(RangeEncoder&, RangeEncoder&, StreamedCell&,
                                                       CodedCells&);
template bool CellCoder<RangeDecoder>::code_by_indices(RangeDecoder&, RangeDecoder&, StreamedCell&,
                                                       CodedCells&);

}  // namespace maille
