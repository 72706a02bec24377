#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "entropy/bit_model.h"
#include "volume/cells/decisions.h"
#include "volume/cells/hull.h"

namespace maille {

/// Where the next cells are, if the encoder may choose their order: faces that a solid left open (edges, of
/// polygons) and that another one will meet are *gates*, in the order in which they came, so that no cell
/// tells where it lies. The encoder says of each open face whether it is a gate or at the border, and brings
/// the cells in the order of the gates (gate_order.h). Also which cell is across each glued face, so that the
/// cells around an edge are found from one to the next. Kept by both directions.
class Gates {
 public:
  /// Across face f of cell slot s: links[s][f], cell slot * 8 + face, or no_slot.
  using Links = std::array<uint32_t, most_faces + 2>;

  /// A cell in memory: what is across its faces, and which of the open ones are gates.
  void enter(const Hull& hull, uint32_t slot, const std::array<FaceRef, most_faces>& glue, unsigned glued,
             unsigned gates) {
    if (slot >= links_.size()) {
      links_.resize(hull.cell_capacity());
      gates_.resize(hull.cell_capacity());
    }
    links_[slot].fill(no_slot);
    gates_[slot] = static_cast<uint8_t>(gates);
    for (unsigned left = glued; left != 0; left &= left - 1) {
      const auto face = static_cast<unsigned>(__builtin_ctz(left));
      const FaceRef other = glue[face];
      links_[slot][face] = other.cell * 8 + other.face;
      links_[other.cell][other.face] = slot * 8 + face;
      close(hull, other);
    }
    const uint32_t ordinal = hull.cell(slot).ordinal;
    for (unsigned left = gates; left != 0; left &= left - 1) {
      const auto face = static_cast<unsigned>(__builtin_ctz(left));
      count_at(hull, {slot, face}, 1);
      waiting_.push_back({slot * 8 + face, ordinal});
    }
    if (waiting_.size() >= sweep_at_) sweep(hull);
  }
  /// So many wait, with those that closed meanwhile.
  size_t held() const { return waiting_.size(); }
  void enter_point(const Hull& hull, uint32_t slot) {
    if (slot >= at_point_.size()) at_point_.resize(hull.point_capacity());
    at_point_[slot] = {};
  }

  bool is_gate(FaceRef face) const { return (gates_[face.cell] >> face.face & 1) != 0; }
  uint32_t link(FaceRef face) const { return links_[face.cell][face.face]; }
  /// How many gates are at a point.
  unsigned at_point(uint32_t slot) const { return at_point_[slot].gates; }
  bool on_border(uint32_t slot) const { return at_point_[slot].border; }
  void mark_border(uint32_t slot) { at_point_[slot].border = true; }

  /// The first of the gates that wait; no_slot: there are none.
  FaceRef next(const Hull& hull) {
    while (first_ < waiting_.size() && !is_there(hull, waiting_[first_])) ++first_;
    tidy();
    if (first_ == waiting_.size()) return {};
    return {waiting_[first_].face / 8, waiting_[first_].face % 8};
  }
  /// The place among these, below `most`, of the first for which found(gate) is true.
  template <class Found>
  unsigned find(const Hull& hull, unsigned most, Found found) const {
    unsigned place = 0;
    for (size_t at = first_; at < waiting_.size() && at < first_ + 64 * most && place < most; ++at) {
      if (!is_there(hull, waiting_[at])) continue;
      if (found(FaceRef{waiting_[at].face / 8, waiting_[at].face % 8})) return place;
      ++place;
    }
    return most;
  }
  /// No cell will be there that says so; one may meet it all the same.
  void close(const Hull& hull, FaceRef face) {
    if (!is_gate(face)) return;
    gates_[face.cell] = static_cast<uint8_t>(gates_[face.cell] & ~(1u << face.face));
    count_at(hull, face, ~0u);
  }

 private:
  struct Gate {
    uint32_t face;  ///< cell slot * 8 + face
    uint32_t ordinal;
  };
  struct AtPoint {
    uint16_t gates = 0;
    bool border = false;
  };

  bool is_there(const Hull& hull, const Gate& gate) const {
    const Hull::Cell& cell = hull.cell(gate.face / 8);
    const unsigned face = gate.face % 8;
    return cell.ordinal == gate.ordinal && cell.live != 0 &&
           (cell.open & gates_[gate.face / 8] & 1u << face) != 0;
  }
  void count_at(const Hull& hull, FaceRef at, uint32_t by) {
    const Hull::Cell& cell = hull.cell(at.cell);
    const CellFace& face = Hull::shape_of(cell).face[at.face];
    for (unsigned i = 0; i < face.size; ++i) {
      const uint32_t point = cell.corner[face.corner[i]];
      if (point != no_slot) at_point_[point].gates = static_cast<uint16_t>(at_point_[point].gates + by);
    }
  }
  void tidy() {
    if (first_ < 4096 || 2 * first_ < waiting_.size()) return;
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<ptrdiff_t>(first_));
    first_ = 0;
  }

  /// Where the first one waits for ever, those behind it that close are held for ever, too: a mesh of no more
  /// than a front would take as much memory as it has cells.
  void sweep(const Hull& hull) {
    std::erase_if(waiting_, [&](const Gate& gate) { return !is_there(hull, gate); });
    first_ = 0;
    sweep_at_ = std::max(size_t{1} << 16, 4 * waiting_.size());
  }

  std::vector<Links> links_;
  std::vector<uint8_t> gates_;  ///< by cell, a bit for each face
  std::vector<AtPoint> at_point_;
  std::vector<Gate> waiting_;
  size_t first_ = 0;
  size_t sweep_at_ = size_t{1} << 16;
};

/// Models of what a cell says at its gate.
struct GateModels {
  std::array<RunModel, 16> plain;  ///< by the last four outcomes
  RunModel attached, here, ends;
  std::array<RunModel, 4> final;  ///< [no gate is left] + 2 [at the border]
  bool border_ends = true;        ///< did the last point at the border without gates end?
  std::vector<RunModel> same_turn = std::vector<RunModel>(shape_count * 64);
  std::vector<BitModel> turn = std::vector<BitModel>(size_t{shape_count} * 64 * 64);
  std::vector<uint8_t> last_turn = std::vector<uint8_t>(shape_count * 64);
  std::vector<BitModel> joined = std::vector<BitModel>(1 << 14);
  std::array<BitModel, shape_count * 64> border;
  unsigned outcomes = 0;
};

}  // namespace maille
