#include "volume/mesh_order.h"

#include <algorithm>
#include <array>
#include <functional>
#include <iterator>

#include "base/bytes.h"
#include "volume/cell_order.h"
#include "volume/cell_shape.h"
#include "volume/decisions.h"

namespace maille {
namespace {

constexpr uint32_t nothing = 0xffffffff;

/// Which of many things are left, so that one of them costs log2 of how many: a tree of counts.
class Remaining {
 public:
  explicit Remaining(uint64_t count) {
    while (size_ < count) size_ *= 2;
    left_.resize(2 * size_);
    for (uint64_t i = 0; i < count; ++i) left_[size_ + i] = 1;
    for (uint64_t i = size_; i-- > 1;) left_[i] = left_[2 * i] + left_[2 * i + 1];
  }
  bool has(uint64_t i) const { return i < size_ && left_[size_ + i] != 0; }
  uint32_t count() const { return left_[1]; }
  void remove(uint64_t i) {
    for (uint64_t node = size_ + i; node > 0; node /= 2) --left_[node];
  }
  template <class Coder>
  uint64_t code(Coder& coder, uint64_t which) const {
    uint64_t node = 1;
    for (uint64_t bit = size_ / 2; bit > 0; bit /= 2) {
      const uint32_t low = left_[2 * node], high = left_[2 * node + 1];
      bool above = low == 0;
      if (low != 0 && high != 0) {
        const uint64_t probability = (uint64_t{high} << 16) / (uint64_t{low} + high);
        above = coder.code((which & bit) != 0,
                           static_cast<uint32_t>(std::clamp<uint64_t>(probability, 1, 65535)));
      }
      node = 2 * node + (above ? 1 : 0);
    }
    return node - size_;
  }

 private:
  uint64_t size_ = 1;
  std::vector<uint32_t> left_;
};

/// The cells around each point, numbered through all blocks.
class Around {
 public:
  Around(const std::vector<CellBlock>& blocks, uint64_t points) : begin_(points + 1) {
    for (const CellBlock& block : blocks) {
      for (const uint32_t point : block.connectivity) ++begin_[point + 1];
    }
    for (uint64_t i = 0; i < points; ++i) begin_[i + 1] += begin_[i];
    cells_.resize(begin_[points]);
    std::vector<uint64_t> end(begin_.begin(), begin_.end() - 1);
    uint32_t cell = 0;
    for (const CellBlock& block : blocks) {
      for (uint64_t i = 0; i < block.size(); ++i, ++cell) {
        for (const uint32_t point : block.cell(i)) cells_[end[point]++] = cell;
      }
    }
  }
  std::span<const uint32_t> of(uint64_t point) const {
    return std::span(cells_).subspan(begin_[point], begin_[point + 1] - begin_[point]);
  }

 private:
  std::vector<uint64_t> begin_;
  std::vector<uint32_t> cells_;
};

uint32_t size_class(uint64_t value) {
  return value < 4 ? static_cast<uint32_t>(value) : 2 + bit_length(value);
}

/// Points in the order of the input: mostly one next to the last, else any of those left. Mesh generators
/// often write all points on the surface behind (or before) all others: those left are of two kinds, and
/// which one comes is told first.
template <class Coder>
class PointOrder {
 public:
  PointOrder(const std::vector<CellBlock>& blocks, uint64_t points)
      : around_(blocks, points),
        on_border_(points_on_border(blocks, points)),
        left_{Remaining(points), Remaining(points)} {
    for (uint64_t i = 0; i < points; ++i) {
      left_[on_border_[i] ? 0 : 1].remove(i);
      if (!around_.of(i).empty()) continue;
      alone_.push_back(static_cast<uint32_t>(i));
      left_[on_border_[i] ? 1 : 0].remove(i);
    }
    for (const CellBlock& block : blocks) {
      for (uint64_t i = 0; i < block.size(); ++i) cells_.push_back(&block), places_.push_back(i);
    }
  }

  /// sequence[i]: the number in coded order of the input's point i. False: damaged.
  bool code(Coder& coder, std::vector<uint32_t>& sequence, uint64_t points) {
    for (uint64_t i = 0; i < points; ++i) {
      const uint32_t point = code_one(coder, Coder::encoding ? sequence[i] : 0);
      if constexpr (!Coder::encoding) {
        if (point == nothing || coder.exhausted()) return false;
        sequence.push_back(point);
      }
      if (!around_.of(point).empty()) {
        left_of(point).remove(point);
        before_ = {last_, before_[0], before_[1]};
        last_ = point;
        kinds_ = kinds_ << 1 | (on_border_[point] ? 1 : 0);
      }
    }
    return true;
  }

 private:
  enum Question : unsigned { near_by, this_one, without_cell, border, question_count };
  struct Candidate {
    uint32_t point;
    uint32_t met;
  };
  Remaining& left_of(uint64_t point) { return left_[on_border_[point] ? 1 : 0]; }
  uint32_t count_left() const { return left_[0].count() + left_[1].count(); }

  static constexpr size_t most_candidates = 48;

  void find_candidates() {
    candidates_.clear();
    if (last_ == nothing) return;
    add(last_ + 1);
    add_around(last_, true);
    joined_ = static_cast<uint32_t>(candidates_.size());
    add_around(last_, false);
    later_ = static_cast<uint32_t>(candidates_.size());
    for (const uint32_t point : before_) {
      if (point != nothing) add_around(point, true);
    }
  }
  /// The points that an edge joins to one, or else share a cell with it.
  void add_around(uint32_t point, bool joined) {
    const std::span<const uint32_t> cells = around_.of(point);
    for (const uint32_t cell : cells.first(std::min<size_t>(cells.size(), 48))) {
      const CellBlock& block = *cells_[cell];
      const CellShape& shape = cell_shapes[kind_of(block.type_of(places_[cell]))];
      const auto points = block.cell(places_[cell]);
      for (unsigned i = 0; i < shape.corners; ++i) {
        if (points[shape.place[i]] != point) continue;
        for (unsigned j = 0; j < shape.corners; ++j) {
          if ((shape.neighbours[i] >> j & 1) == (joined ? 1 : 0)) add(points[shape.place[j]]);
        }
      }
    }
  }
  void add(uint64_t point) {
    if (point >= on_border_.size() || !left_of(point).has(point) || candidates_.size() == most_candidates)
      return;
    for (Candidate& candidate : candidates_) {
      if (candidate.point != point) continue;
      ++candidate.met;
      return;
    }
    candidates_.push_back({static_cast<uint32_t>(point), 1});
  }

  /// Points without cells come up in the order of the input, so that it is always the next one.
  bool code_alone(Coder& coder, uint32_t point) {
    if (next_alone_ == alone_.size()) return false;
    const bool alone = count_left() == 0 ||
                       decisions_.code(coder, Coder::encoding && around_.of(point).empty(), without_cell,
                                       {alone_history_ & 1, alone_history_ & 255, history_ & 15,
                                        alone_history_ & 15, history_ & 1, 0});
    alone_history_ = alone_history_ << 1 | (alone ? 1 : 0);
    return alone;
  }

  uint32_t code_one(Coder& coder, uint32_t point) {
    if (code_alone(coder, point)) return alone_[next_alone_++];
    if (count_left() == 0) return nothing;
    find_candidates();
    const auto count = static_cast<uint32_t>(candidates_.size());
    uint32_t chosen = 0;
    while (Coder::encoding && chosen < count && candidates_[chosen].point != point) ++chosen;
    const Evidence how{std::min<uint32_t>(count, 15), history_ & 255, history_ & 3,
                       size_class(count_left()),      last_rank_,     kinds_ & 15};
    const bool near = count > 0 && decisions_.code(coder, chosen < count, near_by, how);
    history_ = history_ << 1 | (near ? 1 : 0);
    if (!near) return code_left_over(coder, point);
    for (uint32_t i = 0; i < count; ++i) {
      const Candidate& candidate = candidates_[i];
      const uint64_t apart = candidate.point > last_ ? candidate.point - last_ : last_ - candidate.point;
      const uint32_t local = std::min<uint32_t>(i, 31) + (i >= joined_ ? 128 : 0) + (i >= later_ ? 512 : 0) +
                             (candidate.point > last_ ? 32 : 0) + (last_ + 1 == candidate.point ? 64 : 0) +
                             (on_border_[candidate.point] == on_border_[last_] ? 256 : 0);
      const Evidence which{local, last_rank_,    std::min<uint32_t>(candidate.met, 15),
                           count, history_ & 15, size_class(apart)};
      if (i + 1 < count && !decisions_.code(coder, i == chosen, this_one, which)) continue;
      last_rank_ = local;
      return candidate.point;
    }
    return nothing;
  }

  uint32_t code_left_over(Coder& coder, uint32_t point) {
    bool on_border = left_[0].count() == 0;
    if (!on_border && left_[1].count() != 0) {
      on_border = decisions_.code(coder, Coder::encoding && on_border_[point], border,
                                  {kinds_ & 3, kinds_ & 255, history_ & 7, kinds_ & 15, 0, 0});
    }
    return static_cast<uint32_t>(left_[on_border ? 1 : 0].code(coder, point));
  }

  Around around_;
  std::vector<bool> on_border_;
  std::array<Remaining, 2> left_;  ///< not on the border, and on it
  uint32_t kinds_ = 0;             ///< of the last points: on the border?
  std::vector<const CellBlock*> cells_;
  std::vector<uint64_t> places_;
  std::vector<Candidate> candidates_;
  uint32_t joined_ = 0;  ///< candidates before those that only share a cell
  uint32_t later_ = 0;   ///< candidates before those around earlier points
  std::array<uint32_t, 3> before_{nothing, nothing, nothing};
  std::vector<uint32_t> alone_;
  size_t next_alone_ = 0;
  uint32_t alone_history_ = 0;
  Decisions<question_count> decisions_{true};
  uint32_t last_ = nothing, history_ = 0, last_rank_ = 0;
};

/// Cells of a block in the order of the input, with the input's numbers of points: one next to the last; or
/// one at the next points, as mesh generators write them that go from point to point; else any of those left.
template <class Coder>
class CellSequence {
 public:
  CellSequence(const std::vector<CellBlock>& blocks, uint64_t points)
      : around_(blocks, points), points_(points) {}

  /// Not points that very many cells have: looking through them each time would take the square of time.
  bool can_lead(uint64_t point) const { return around_.of(point).size() <= 64; }

  /// sequence[i]: the place in coded order of the input's cell i. `leader`: for the encoder, a point of each
  /// cell that goes up from cell to cell, or none. False: damaged.
  bool code(Coder& coder, const CellBlock& block, uint64_t first, const std::vector<uint32_t>& leader,
            std::vector<uint32_t>& sequence) {
    block_ = &block;
    first_ = first;
    Remaining left(block.size());
    left_ = &left;
    neighbours_ = neighbours_of(block);
    last_ = nothing;
    at_ = 0;
    for (uint64_t i = 0; i < block.size(); ++i) {
      const uint32_t cell =
          code_one(coder, Coder::encoding ? sequence[i] : nothing, Coder::encoding ? leader[i] : nothing);
      if constexpr (!Coder::encoding) {
        if (cell == nothing || coder.exhausted()) return false;
        sequence.push_back(cell);
      }
      left.remove(cell);
      last_ = cell;
    }
    return true;
  }

 private:
  enum Question : unsigned { near_by, this_one, by_point, leaps, at_point, question_count };
  static constexpr uint64_t reach = 128;

  uint32_t code_one(Coder& coder, uint32_t cell, uint32_t leader) {
    find_near();
    uint32_t chosen = 0;
    while (Coder::encoding && chosen < near_.size() && near_[chosen].cell != cell) ++chosen;
    const auto count = static_cast<uint32_t>(near_.size());
    const Evidence how{beside_, history_ & 255, history_ & 15, waiting_at(at_), last_rank_, count};
    // A leader goes before: it moves the place from which the next ones are sought.
    const bool led = decisions_.code(coder, leader != nothing, by_point, how);
    if (led) {
      history_ = history_ << 2 | 1;
      return code_led(coder, cell, leader);
    }
    if (count > 0 && decisions_.code(coder, chosen < count, near_by, how)) {
      history_ = history_ << 2 | 2;
      return code_near(coder, chosen);
    }
    history_ <<= 2;
    return left_->count() == 0 ? nothing : static_cast<uint32_t>(left_->code(coder, cell));
  }

  struct Near {
    uint32_t cell;
    uint32_t met;
  };
  static constexpr size_t most_near = 64;

  void find_near() {
    near_.clear();
    if (last_ == nothing) return;
    add_near(last_ + 1);
    for (const uint32_t cell : neighbours_[last_]) add_near(cell);
    beside_ = static_cast<uint32_t>(near_.size());
    for (const uint32_t point : block_->cell(last_)) {
      if (!can_lead(point)) continue;
      for (const uint32_t cell : around_.of(point)) {
        if (cell >= first_ && cell - first_ < block_->size()) add_near(static_cast<uint32_t>(cell - first_));
      }
    }
  }
  void add_near(uint32_t cell) {
    if (!left_->has(cell)) return;
    for (Near& near : near_) {
      if (near.cell != cell) continue;
      ++near.met;
      return;
    }
    if (near_.size() < most_near) near_.push_back({cell, 1});
  }
  uint32_t code_near(Coder& coder, uint32_t chosen) {
    const auto count = static_cast<uint32_t>(near_.size());
    for (uint32_t i = 0; i < count; ++i) {
      const Near& near = near_[i];
      uint32_t face = 7;
      for (uint32_t f = 0; f < most_faces; ++f) {
        if (neighbours_[last_][f] == near.cell) face = f;
      }
      const uint32_t local = face | std::min<uint32_t>(i, 7) << 3 | (near.cell == last_ + 1 ? 64u : 0) |
                             std::min<uint32_t>(near.met, 7) << 7;
      const Evidence which{local, last_rank_, rank_of(near.cell), count, history_ & 255, i};
      if (i + 1 < count && !decisions_.code(coder, i == chosen, this_one, which)) continue;
      last_rank_ = local;
      return near.cell;
    }
    return nothing;
  }

  /// How far above `at_` the next point of a cell is.
  uint32_t rank_of(uint32_t cell) const {
    uint64_t least = ~uint64_t{0};
    for (const uint32_t point : block_->cell(cell)) {
      if (point >= at_) least = std::min<uint64_t>(least, point - at_);
    }
    return size_class(least);
  }
  bool waits(uint32_t cell) const {
    return cell >= first_ && cell - first_ < block_->size() && left_->has(cell - first_);
  }
  uint32_t waiting_at(uint64_t point) const {
    uint32_t count = 0;
    if (!can_lead(point)) return 0;
    for (const uint32_t cell : around_.of(point)) count += waits(cell) && count < 15 ? 1 : 0;
    return count;
  }

  uint32_t code_led(Coder& coder, uint32_t cell, uint64_t leader) {
    const bool leap = decisions_.code(coder, Coder::encoding && leader - at_ >= reach, leaps, {});
    if (leap) {
      const int64_t by = leap_.code(coder, static_cast<int64_t>(leader - at_));
      if (by < 0 || static_cast<uint64_t>(by) >= points_ - at_) return nothing;
      at_ += static_cast<uint64_t>(by);
    }
    for (uint64_t gap = 0; gap < reach && at_ + gap < points_; ++gap) {
      if (!can_lead(at_ + gap)) continue;
      const uint32_t count = waiting_at(at_ + gap);
      uint32_t rank = 0;
      for (const uint32_t other : around_.of(at_ + gap)) {
        if (!waits(other)) continue;
        const auto here = static_cast<uint32_t>(other - first_);
        uint32_t corner = 0, lower = 0;
        const auto points = block_->cell(here);
        for (uint32_t i = 0; i < points.size(); ++i) {
          if (points[i] == at_ + gap) corner = i;
          lower += points[i] < at_ + gap;
        }
        const uint32_t local = static_cast<uint32_t>(gap == 0) | count << 1 | lower << 5;
        const Evidence which{
            local, corner << 4 | last_corner_, rank << 4 | count, size_class(gap), history_ & 255, corner};
        ++rank;
        if (!decisions_.code(coder, here == cell && (leap || at_ + gap == leader), at_point, which)) continue;
        at_ += gap;
        last_corner_ = corner & 15;
        return here;
      }
    }
    return nothing;
  }

  Around around_;
  uint64_t points_;
  const CellBlock* block_ = nullptr;
  uint64_t first_ = 0;
  Remaining* left_ = nullptr;
  std::vector<std::array<uint32_t, most_faces>> neighbours_;
  std::vector<Near> near_;
  uint32_t beside_ = 0;  ///< of them, those that follow or share a face
  Decisions<question_count> decisions_{true};
  DifferenceModel leap_;
  uint64_t at_ = 0;
  uint32_t last_ = nothing, history_ = 0, last_rank_ = 0, last_corner_ = 0;
};

/// A point for each of the most cells for which it can go up from cell to cell (a longest increasing
/// subsequence, with one of several values at each place); nothing for the others.
template <class CanLead>
std::vector<uint32_t> leaders_of(const CellBlock& block, CanLead can_lead) {
  struct Link {
    uint32_t cell, point, before;
  };
  std::vector<Link> links;
  std::vector<uint32_t> least;  // by length: the link that ends lowest
  std::vector<uint32_t> points, ends;
  for (uint64_t i = 0; i < block.size(); ++i) {
    points.clear();
    std::copy_if(block.cell(i).begin(), block.cell(i).end(), std::back_inserter(points), can_lead);
    std::sort(points.begin(), points.end(), std::greater<>());
    ends.clear();
    for (const uint32_t point : points) {
      const auto end =
          std::upper_bound(least.begin(), least.end(), point,
                           [&](uint32_t value, uint32_t link) { return value < links[link].point; });
      ends.push_back(static_cast<uint32_t>(end - least.begin()));
    }
    const size_t first_new = links.size();
    for (size_t k = 0; k < points.size(); ++k) {
      links.push_back({static_cast<uint32_t>(i), points[k], ends[k] == 0 ? nothing : least[ends[k] - 1]});
    }
    for (size_t k = 0; k < points.size(); ++k) {
      const auto link = static_cast<uint32_t>(first_new + k);
      if (ends[k] == least.size()) {
        least.push_back(link);
      } else if (points[k] < links[least[ends[k]]].point) {
        least[ends[k]] = link;
      }
    }
  }
  std::vector<uint32_t> leader(block.size(), nothing);
  for (uint32_t link = least.empty() ? nothing : least.back(); link != nothing; link = links[link].before)
    leader[links[link].cell] = links[link].point;
  return leader;
}

/// Cells of a block at the places that `place` gives: the k-th comes from place[k].
CellBlock rearranged(const CellBlock& block, const std::vector<uint64_t>& place) {
  CellBlock out = block;
  if (place.empty()) return out;
  out.connectivity.clear();
  for (uint64_t i = 0; i < block.size(); ++i) {
    const auto points = block.cell(place[i]);
    out.connectivity.insert(out.connectivity.end(), points.begin(), points.end());
    if (!out.types.empty()) out.types[i] = block.types[place[i]];
    if (!out.offsets.empty()) out.offsets[i + 1] = out.connectivity.size();
  }
  return out;
}

/// Numbers of points in the order in which coded cells meet them; those without cells behind, in order.
std::vector<uint32_t> sequence_of_points(const std::vector<CellBlock>& coded, uint64_t points) {
  std::vector<uint32_t> number(points, nothing);
  uint32_t next = 0;
  for (const CellBlock& block : coded) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const CellShape& shape = cell_shapes[kind_of(block.type_of(i))];
      for (unsigned k = 0; k < shape.nodes; ++k) {
        uint32_t& of = number[block.cell(i)[shape.place[k]]];
        if (of == nothing) of = next++;
      }
    }
  }
  for (uint32_t& of : number) {
    if (of == nothing) of = next++;
  }
  return number;
}

void rearrange(Array& array, const std::vector<uint32_t>& place) {
  const size_t size = array.tuple_size();
  std::vector<std::byte> bytes(array.bytes.size());
  for (size_t i = 0; i < place.size(); ++i)
    std::copy_n(array.bytes.data() + place[i] * size, size, bytes.data() + i * size);
  array.bytes = std::move(bytes);
}

}  // namespace

bool all_have_shapes(const Mesh& mesh) {
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      if (kind_of(block.type_of(i)) >= shape_count) return false;
    }
  }
  return true;
}

std::vector<std::byte> join_order(const CodedOrder& order) {
  ByteWriter out;
  out.put_count(order.points.size());
  out.put_bytes(order.points);
  out.put_bytes(order.cells);
  return out.take();
}

std::optional<CodedOrder> split_order(Bytes bytes) {
  ByteReader in(bytes);
  const Bytes points = in.get_bytes(in.get_count()), cells = in.get_bytes(in.remaining());
  if (!in.ok()) return {};
  return CodedOrder{{points.begin(), points.end()}, {cells.begin(), cells.end()}};
}

CodedOrder encode_order(const Mesh& mesh, const CellOrders& orders) {
  std::vector<CellBlock> coded;
  for (size_t b = 0; b < mesh.blocks.size(); ++b) coded.push_back(rearranged(mesh.blocks[b], orders[b]));
  const std::vector<CellBlock> numbered = coded;
  std::vector<uint32_t> sequence = sequence_of_points(coded, mesh.point_count());
  for (CellBlock& block : coded) {
    for (uint32_t& point : block.connectivity) point = sequence[point];
  }
  RangeEncoder points, cells;
  PointOrder<RangeEncoder>(coded, mesh.point_count()).code(points, sequence, mesh.point_count());
  CellSequence<RangeEncoder> order(numbered, mesh.point_count());
  uint64_t first = 0;
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    const uint64_t size = mesh.blocks[b].size();
    std::vector<uint32_t> places(size);
    for (size_t i = 0; i < size; ++i) places[orders[b].empty() ? i : orders[b][i]] = static_cast<uint32_t>(i);
    const auto can_lead = [&](uint32_t point) { return order.can_lead(point); };
    order.code(cells, numbered[b], first, leaders_of(mesh.blocks[b], can_lead), places);
    first += size;
  }
  return {points.finish(), cells.finish()};
}

std::optional<InputOrder> decode_order(const Mesh& coded, const CodedOrder& order) {
  InputOrder found;
  RangeDecoder points(order.points), cells(order.cells);
  const uint64_t count = coded.point_count();
  if (!PointOrder<RangeDecoder>(coded.blocks, count).code(points, found.points, count)) return {};
  std::vector<uint32_t> number(count);
  for (size_t i = 0; i < count; ++i) number[found.points[i]] = static_cast<uint32_t>(i);
  std::vector<CellBlock> blocks = coded.blocks;
  for (CellBlock& block : blocks) {
    for (uint32_t& point : block.connectivity) point = number[point];
  }
  CellSequence<RangeDecoder> sequence(blocks, count);
  uint32_t first = 0;
  for (const CellBlock& block : blocks) {
    std::vector<uint32_t> places;
    if (!sequence.code(cells, block, first, {}, places)) return {};
    for (const uint32_t place : places) found.cells.push_back(first + place);
    first += static_cast<uint32_t>(places.size());
  }
  return found;
}

bool restore_order(Mesh& mesh, const CodedOrder& order) {
  const auto found = decode_order(mesh, order);
  if (!found) return false;
  rearrange(mesh.points, found->points);
  for (Array& array : mesh.arrays) {
    if (array.domain == Domain::point) rearrange(array, found->points);
    if (array.domain == Domain::cell) rearrange(array, found->cells);
  }
  std::vector<uint32_t> number(found->points.size());
  for (size_t i = 0; i < number.size(); ++i) number[found->points[i]] = static_cast<uint32_t>(i);
  uint64_t first = 0;
  for (CellBlock& block : mesh.blocks) {
    std::vector<uint64_t> places(block.size());
    for (size_t i = 0; i < places.size(); ++i) places[i] = found->cells[first + i] - first;
    for (uint32_t& point : block.connectivity) point = number[point];
    block = rearranged(block, places);
    first += places.size();
  }
  return true;
}

}  // namespace maille
