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
/// polygons) and that another one will meet are *gates*. They wait in the order in which they came up, so
/// that no cell tells where it lies. The encoder says of each open face whether it is a gate or at the
/// border, and brings the cells in the order of the gates (gate_order.h).
/// Also kept is which face is across each glued one, and how it lies there, so that a walk through the cells
/// around an edge compares no points. Both directions keep all of this alike. Oldest gate first: with the
/// newest first connectivity takes 1.1 (hand) to 2.8 times as much (canewt; docs/history.md, "Gates instead
/// of the front").
class Gates {
 public:
  static constexpr unsigned no_edge = 4;
  /// What a walk needs of a cell in memory: half a line of a cache.
  struct alignas(32) Cell {
    std::array<uint32_t, most_faces> across;  ///< by face: cell slot * 8 + face, or no_slot
    std::array<uint8_t, most_faces> turn;  ///< by glued face: how it lies on the one across (edge_across())
    uint8_t kind = 0;
    uint8_t gates = 0;  ///< a bit for each face
  };

  /// A cell in memory: what is across its faces, and which of the open ones are gates.
  void enter(const Hull& hull, uint32_t slot, const std::array<FaceRef, most_faces>& glue, unsigned glued,
             unsigned gates) {
    if (slot >= cells_.size()) cells_.resize(hull.cell_capacity());
    Cell& cell = cells_[slot];
    cell.across.fill(no_slot);
    cell.kind = hull.cell(slot).kind;
    cell.gates = static_cast<uint8_t>(gates);
    for (unsigned left = glued; left != 0; left &= left - 1) {
      const auto face = static_cast<unsigned>(__builtin_ctz(left));
      const FaceRef other = glue[face];
      join(hull, {slot, face}, other);
      close(hull, other);
    }
    // The ordinal tells a gate of this cell from one of a later cell in the same slot.
    const uint32_t ordinal = hull.cell(slot).ordinal;
    for (unsigned left = gates; left != 0; left &= left - 1) {
      const auto face = static_cast<unsigned>(__builtin_ctz(left));
      count_at(hull, {slot, face}, 1);
      waiting_.push_back({slot * 8 + face, ordinal});
    }
    if (waiting_.size() >= sweep_at_) sweep(hull);
  }
  /// How many entries the queue holds, with those that closed meanwhile: for tests of its memory.
  size_t held() const { return waiting_.size(); }
  // A slot's counts begin anew with each point.
  void enter_point(const Hull& hull, uint32_t slot) {
    if (slot >= at_point_.size()) at_point_.resize(hull.point_capacity());
    at_point_[slot] = {};
  }

  /// Also of a face that closed as a point ended: only a cell that comes there, or close(), clears the bit.
  bool is_gate(FaceRef face) const { return (cells_[face.cell].gates >> face.face & 1) != 0; }
  const Cell& cell(uint32_t slot) const { return cells_[slot]; }
  /// The edge of the face across that lies on edge `edge` of a glued one; no_edge: the two faces have the
  /// same points in another cycle, as only damaged or odd meshes have, and the caller compares points
  /// instead.
  static unsigned edge_across(unsigned turn, unsigned size, unsigned edge) {
    if (turn >= other_cycle) [[unlikely]]
      return no_edge;
    const unsigned at = turn < mirrored ? turn + size - edge : turn - mirrored + edge;
    return at < size ? at : at - size;
  }
  /// The edge of a face that joins two points.
  static unsigned edge_between(const Hull& hull, FaceRef face, uint32_t a, uint32_t b) {
    const Hull::Cell& cell = hull.cell(face.cell);
    const CellFace& of = Hull::shape_of(cell).face[face.face];
    for (unsigned i = 0, last = of.size - 1u; i < of.size; last = i++) {
      const uint32_t p = cell.corner[of.corner[last]], q = cell.corner[of.corner[i]];
      if ((p == a && q == b) || (p == b && q == a)) return last;
    }
    return no_edge;
  }
  /// How many gates are at a point. Modulo 2^16 on both sides; it only steers what is expected of ends.
  unsigned at_point(uint32_t slot) const { return at_point_[slot].gates; }
  bool on_border(uint32_t slot) const { return at_point_[slot].border; }
  void mark_border(uint32_t slot) { at_point_[slot].border = true; }

  /// The first of the gates that wait; no_slot: there are none. Those that closed meanwhile are dropped for
  /// good, so that over a whole stream this loop does as many steps as gates came up.
  FaceRef next(const Hull& hull) {
    while (first_ < waiting_.size() && !is_there(hull, waiting_[first_])) ++first_;
    tidy();
    if (first_ == waiting_.size()) return {};
    return {waiting_[first_].face / 8, waiting_[first_].face % 8};
  }
  /// The place among these, below `most`, of the first for which found(gate) is true; `most` if there is
  /// none. It also stops after 64 * most entries, whether they still wait or not: encoder only, so that this
  /// bound is no part of the format.
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
  /// Gives a gate up: no cell will come there that says so. Its face stays open, so that a cell may still
  /// meet it by other ways.
  void close(const Hull& hull, FaceRef face) {
    if (!is_gate(face)) return;
    Cell& cell = cells_[face.cell];
    cell.gates = static_cast<uint8_t>(cell.gates & ~(1u << face.face));
    count_at(hull, face, ~0u);
  }

  uint64_t bytes() const { return bytes_held(cells_) + bytes_held(at_point_) + bytes_held(waiting_); }

 private:
  /// Edge i of a glued face lies on edge turn - i of the one across, modulo their size, as faces of
  /// neighbours run in opposite directions; from `mirrored` on, on edge turn - mirrored + i.
  static constexpr unsigned mirrored = 4, other_cycle = 8;
  struct Gate {
    uint32_t face;  ///< cell slot * 8 + face
    uint32_t ordinal;
  };
  struct AtPoint {
    uint16_t gates = 0;
    bool border = false;
  };

  void join(const Hull& hull, FaceRef own, FaceRef other) {
    Cell &here = cells_[own.cell], &there = cells_[other.cell];
    here.across[own.face] = other.cell * 8 + other.face;
    there.across[other.face] = own.cell * 8 + own.face;
    const unsigned size = cell_shapes[here.kind].face[own.face].size;
    if (size < 3) return;  // of polygons: nobody walks there
    const unsigned turn = turn_on(hull, own, other, size);
    here.turn[own.face] = static_cast<uint8_t>(turn);
    const bool inverted = turn > mirrored && turn < other_cycle;
    there.turn[other.face] = static_cast<uint8_t>(inverted ? 2 * mirrored + size - turn : turn);
  }
  /// How one glued face lies on the other (see `mirrored`), or other_cycle where the same points do not
  /// follow one another in the same order.
  static unsigned turn_on(const Hull& hull, FaceRef own, FaceRef other, unsigned size) {
    const Hull::Cell &cell = hull.cell(own.cell), &there = hull.cell(other.cell);
    const CellFace &face = Hull::shape_of(cell).face[own.face], &on = Hull::shape_of(there).face[other.face];
    const auto point = [&](unsigned i) { return cell.corner[face.corner[i]]; };
    const auto met = [&](unsigned i) { return there.corner[on.corner[i < size ? i : i - size]]; };
    const uint32_t first = point(0);
    const unsigned at = met(0) == first ? 0 : met(1) == first ? 1 : met(2) == first ? 2 : 3;
    const bool opposite = size == 3 || met(at + 2) == point(2);
    if (at >= size || !opposite) return other_cycle;
    if (met(at + size - 1) == point(1)) return at == 0 ? size - 1 : at - 1;
    return met(at + 1) == point(1) ? mirrored + at : other_cycle;
  }

  bool is_there(const Hull& hull, const Gate& gate) const {
    const Hull::Cell& cell = hull.cell(gate.face / 8);
    const unsigned face = gate.face % 8;
    return cell.ordinal == gate.ordinal && cell.live != 0 &&
           (cell.open & cells_[gate.face / 8].gates & 1u << face) != 0;
  }
  void count_at(const Hull& hull, FaceRef at, uint32_t by) {
    const Hull::Cell& cell = hull.cell(at.cell);
    const CellFace& face = Hull::shape_of(cell).face[at.face];
    for (unsigned i = 0; i < face.size; ++i) {
      const uint32_t point = cell.corner[face.corner[i]];
      if (point != no_slot) at_point_[point].gates = static_cast<uint16_t>(at_point_[point].gates + by);
    }
  }
  // Moving what is left each time half of the queue is used up costs at most one move for each entry that was
  // dropped.
  void tidy() {
    if (first_ < 4096 || 2 * first_ < waiting_.size()) return;
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<ptrdiff_t>(first_));
    first_ = 0;
  }

  /// Where the first one waits for ever, those behind it that close are held for ever, too: a mesh of no more
  /// than a front would take as much memory as it has cells. Sweeping at four times what was left makes it
  /// linear in all. Nothing that is coded depends on when this happens.
  void sweep(const Hull& hull) {
    std::erase_if(waiting_, [&](const Gate& gate) { return !is_there(hull, gate); });
    first_ = 0;
    sweep_at_ = std::max(size_t{1} << 16, 4 * waiting_.size());
  }

  std::vector<Cell> cells_;
  std::vector<AtPoint> at_point_;
  std::vector<Gate> waiting_;
  size_t first_ = 0;
  size_t sweep_at_ = size_t{1} << 16;
};

/// Models of what a cell says at its gate. Rows of 64 are 8 * face of the gate + own face by which the gate's
/// cell came (7: none); 2^14 contexts of `joined` are what join_beside() packs into 14 bits.
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
