#pragma once

#include "volume/order/flat_cells.h"

namespace maille {

/// For each point those that an edge joins to it, and in how many cells: found for all at once, as each is
/// asked for four times. At most 48 cells around a point are looked at, so that memory is bounded by the
/// cells.
class Joined {
 public:
  using List = MetList<48 * 7>;  // 48 cells with up to 7 neighbours of a corner

  Joined(const FlatCells& cells, uint64_t points) {
    List list(points);
    begin_.reserve(points + 1);
    for (uint64_t i = 0; i < points; ++i) {
      begin_.push_back(items_.size());
      list.clear();
      for_each_beside(cells, static_cast<uint32_t>(i), true, [&](uint32_t point) { list.add(point); });
      items_.insert(items_.end(), list.items().begin(), list.items().end());
    }
    begin_.push_back(items_.size());
  }
  /// Will be asked for, perhaps.
  void fetch(uint64_t point) const { __builtin_prefetch(&begin_[point]); }
  std::span<const List::Item> of(uint64_t point) const {
    return std::span(items_).subspan(begin_[point], begin_[point + 1] - begin_[point]);
  }

 private:
  std::vector<uint64_t> begin_;
  std::vector<List::Item> items_;
};

/// Points in the order of the input: mostly one next to the last, else any of those left. Mesh generators
/// often write all points on the surface behind (or before) all others: those left are of two kinds, and
/// which one comes is told first. (Border points before inner ones: 8.84 to 8.35 bits a hexahedron;
/// candidates beside three earlier points, too: 8.30. docs/history.md, "Numbering of HexaLab-type files".)
/// docs/format.md, 16.10, "Points".
template <class Coder>
class PointOrder {
 public:
  PointOrder(const FlatCells& cells, const std::vector<uint8_t>& on_border, uint64_t points, Mixing mixing)
      : cells_(cells),
        on_border_(on_border),
        left_{Remaining(points), Remaining(points)},
        waits_(points, 1),
        joined_points_(cells, points),
        candidates_(points),
        mixed_(mixing != Mixing::none),
        decisions_(mixing) {
    for (uint64_t i = 0; i < points; ++i) {
      left_[on_border_[i] ? 0 : 1].remove(i);
      if (!cells.around(i).empty()) continue;
      alone_.push_back(static_cast<uint32_t>(i));
      left_[on_border_[i]].remove(i);
      waits_[i] = 0;
    }
  }

  /// Codes all points. sequence[i]: the number in coded order of the input's point i. False: damaged. Only
  /// points that are left are ever found, so that what is decoded is a permutation.
  bool code(Coder& coder, std::vector<uint32_t>& sequence, uint64_t points) {
    for (uint64_t i = 0; i < points; ++i) {
      const uint32_t input = Coder::encoding ? sequence[i] : 0;
      const bool alone = code_alone(coder, input);
      const uint32_t point = alone ? alone_[next_alone_++] : code_one(coder, input);
      if constexpr (!Coder::encoding) {
        if (point == nothing || coder.exhausted()) return false;
        sequence.push_back(point);
      }
      if (!alone) {
        left_[on_border_[point]].remove(point);
        waits_[point] = 0;
        before_ = {last_, before_[0], before_[1]};
        last_ = point;
        kinds_ = kinds_ << 1 | on_border_[point];
      }
    }
    return true;
  }

 private:
  enum Question : unsigned { near_by, this_one, without_cell, border, question_count };
  uint64_t count_left() const { return left_[0].count() + left_[1].count(); }

  void find_joined() {
    candidates_.clear();
    if (last_ == nothing) return;
    add(last_ + uint64_t{1}, 1);
    add_joined(last_);
    joined_ = later_ = candidates_.size();
    for (const auto& candidate : candidates_.items()) joined_points_.fetch(candidate.which);
  }
  void find_others() {
    for_each_beside(cells_, last_, false, [&](uint32_t point) { add(point, 1); });
    later_ = candidates_.size();
    for (const uint32_t point : before_) {
      if (point != nothing) add_joined(point);
    }
  }
  void add_joined(uint32_t point) {
    for (const auto& other : joined_points_.of(point)) add(other.which, other.met);
  }
  void add(uint64_t point, uint32_t times) {
    if (point < waits_.size() && waits_[point] != 0) candidates_.add(static_cast<uint32_t>(point), times);
  }

  /// Points without cells come up in the order of the input, so that it is always the next one.
  bool code_alone(Coder& coder, uint32_t point) {
    if (next_alone_ == alone_.size()) return false;
    const bool alone =
        count_left() == 0 ||
        decisions_.code(coder, Coder::encoding && cells_.around(point).empty(), without_cell,
                        {alone_history_ & 1, history_ & 15, alone_history_ & 15, history_ & 1});
    alone_history_ = alone_history_ << 1 | (alone ? 1 : 0);
    return alone;
  }

  /// One point that cells have; nothing: damaged.
  uint32_t code_one(Coder& coder, uint32_t point) {
    if (count_left() == 0) return nothing;
    find_joined();
    const Evidence how{std::min<uint32_t>(static_cast<uint32_t>(candidates_.size()), 15), history_ & 3,
                       size_class(count_left()), last_rank_};
    bool near = false;
    uint32_t chosen = nothing;
    if (Coder::encoding && last_ != nothing) {
      // An encoder needs all candidates to know whether the point is one of them; a decoder looks for more
      // only when the first ones were refused.
      find_others();
      chosen = candidates_.place_of(point);
      near = chosen < candidates_.size();
    }
    near = last_ != nothing && decisions_.code(coder, near, near_by, how);
    history_ = history_ << 1 | (near ? 1 : 0);
    if (!near) return code_left_over(coder, point);
    // Most points are joined to the last: others are sought where these end, or all count as evidence.
    bool sought = Coder::encoding;
    for (uint32_t i = 0;; ++i) {
      if (!sought && (mixed_ || i + 1 >= joined_)) {
        find_others();
        sought = true;
      }
      const auto count = static_cast<uint32_t>(candidates_.size());
      // All were refused: only a damaged stream does that.
      if (i == count) return nothing;
      const uint32_t candidate = candidates_[i].which;
      __builtin_prefetch(joined_points_.of(candidate).data());
      const uint32_t local = std::min<uint32_t>(i, 31) + (i >= joined_ ? 128 : 0) + (i >= later_ ? 512 : 0) +
                             (candidate > last_ ? 32 : 0) + (last_ + 1 == candidate ? 64 : 0) +
                             (on_border_[candidate] == on_border_[last_] ? 256 : 0);
      const Evidence which{local, std::min<uint32_t>(candidates_[i].met, 15), count, history_ & 15};
      if (i + 1 < count && !decisions_.code(coder, i == chosen, this_one, which)) continue;
      last_rank_ = local;
      return candidate;
    }
  }

  /// Any of those left, each as probable as any other, of the kind that is told first.
  uint32_t code_left_over(Coder& coder, uint32_t point) {
    bool on_border = left_[0].count() == 0;
    if (!on_border && left_[1].count() != 0) {
      on_border = decisions_.code(coder, Coder::encoding && on_border_[point], border,
                                  {kinds_ & 3, history_ & 7, kinds_ & 15, 0});
    }
    return static_cast<uint32_t>(left_[on_border ? 1 : 0].code(coder, point));
  }

  const FlatCells& cells_;
  const std::vector<uint8_t>& on_border_;
  std::array<Remaining, 2> left_;  ///< not on the border, and on it
  std::vector<uint8_t> waits_;     ///< by point: it is left, of either kind
  uint32_t kinds_ = 0;             ///< of the last points: on the border?
  Joined joined_points_;
  MetList<48> candidates_;
  size_t joined_ = 0;  ///< candidates before those that only share a cell
  size_t later_ = 0;   ///< candidates before those around earlier points
  std::array<uint32_t, 3> before_{nothing, nothing, nothing};
  std::vector<uint32_t> alone_;
  size_t next_alone_ = 0;
  uint32_t alone_history_ = 0;
  bool mixed_;
  Decisions<question_count> decisions_;
  uint32_t last_ = nothing, history_ = 0, last_rank_ = 0;
};

}  // namespace maille
