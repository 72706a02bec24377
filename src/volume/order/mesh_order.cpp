#include "volume/order/mesh_order.h"

#include <algorithm>
#include <array>
#include <functional>
#include <iterator>
#include <numeric>

#include "base/bytes.h"
#include "code/residual_model.h"
#include "entropy/rans.h"
#include "volume/order/cell_order.h"
#include "volume/order/point_order.h"

namespace maille {
namespace {

/// Cells of a block in the order of the input, with the input's numbers of points. The next cell is near one
/// of the last ones; or at one of the next points, as mesh generators write cells that go from point to
/// point; else any of those left. Encoder and decoder keep the same lists of what is left and which cells are
/// near, in the same order.
template <class Coder>
class CellSequence {
 public:
  /// Nodes of `cells` are the input's numbers of points, and those around each point are found by that of the
  /// coded order, which `sequence` has for each of the input's.
  CellSequence(const FlatCells& cells, const std::vector<uint32_t>& sequence, uint64_t most_cells,
               Mixing mixing)
      : cells_(cells),
        waiting_(sequence.size()),
        near_(most_cells),
        mixed_(mixing != Mixing::none),
        decisions_(mixing) {
    around_.reserve(sequence.size());
    for (const uint32_t point : sequence) around_.push_back(cells.around(point));
  }

  /// Whether cells around the point are looked through. Not at points that very many cells have: looking
  /// through them each time would take the square of time.
  bool can_lead(uint64_t point) const { return around_[point].size() <= 64; }

  /// places[i]: the place in coded order of the input's cell i. `leader`: for the encoder, a point of each
  /// cell that goes up from cell to cell, or none. False: damaged.
  bool code(Coder& coder, uint64_t first, uint64_t size, const Neighbours& neighbours,
            const std::vector<uint32_t>& leader, std::vector<uint32_t>& places) {
    Remaining left(size);
    first_ = first;
    size_ = size;
    left_ = &left;
    neighbours_ = &neighbours;
    recent_.fill(nothing);
    at_ = 0;
    count_waiting(1);
    // exhausted() ends a damaged stream; left.remove() is safe, as only cells that are left are ever found.
    for (uint64_t i = 0; i < size; ++i) {
      const uint32_t cell =
          code_one(coder, Coder::encoding ? places[i] : nothing, Coder::encoding ? leader[i] : nothing);
      if constexpr (!Coder::encoding) {
        if (cell == nothing || coder.exhausted()) return false;
        places.push_back(cell);
      }
      left.remove(cell);
      for (const uint32_t point : nodes_of(cell)) --waiting_[point];
      std::copy_backward(recent_.begin(), recent_.end() - 1, recent_.end());
      recent_[0] = cell;
    }
    return true;
  }

 private:
  enum Question : unsigned { near_by, this_one, by_point, leaps, at_point, near_earlier, question_count };
  // How far above the last leader the next one is sought before a leap is told: 128 points. Part of the
  // format.
  static constexpr uint64_t reach = 128;
  /// How many of the last cells may have the next one near: with the last one alone gmsh's tetrahedra take 2
  /// to 4 % more, with 16 the same.
  static constexpr unsigned most_recent = 8;

  std::span<const uint32_t> nodes_of(uint64_t cell) const { return cells_.nodes_of_cell(first_ + cell); }
  void count_waiting(uint32_t by) {
    for (uint64_t i = 0; i < size_; ++i) {
      for (const uint32_t point : nodes_of(i)) waiting_[point] += by;
    }
  }

  /// One cell; nothing: damaged. The order of questions is that of docs/format.md, 16.10, "Cells".
  uint32_t code_one(Coder& coder, uint32_t cell, uint32_t leader) {
    find_beside(recent_[0]);
    const Evidence how{static_cast<uint32_t>(beside_), history_ & 15, waiting_at(at_), last_rank_};
    // A leader goes before: it moves the place from which the next ones are sought.
    const bool led = decisions_.code(coder, leader != nothing, by_point, how);
    if (led) {
      history_ = history_ << 2 | 1;
      return code_led(coder, cell, leader);
    }
    const bool any_beside = beside_ > 0;
    const unsigned wanted = Coder::encoding ? find_recent(cell) : most_recent;
    for (unsigned back = 0; back < most_recent; ++back) {
      // Nothing near it is left, which both sides know: no question.
      if (!has_waiting(recent_[back]) && !(back == 0 && any_beside)) continue;
      const Evidence earlier{back, found_back_ & 15, found_back_ & 255, back << 4 | (history_ & 15)};
      if (!decisions_.code(coder, back == wanted, back == 0 ? near_by : near_earlier,
                           back == 0 ? how : earlier))
        continue;
      history_ = history_ << 2 | 2;
      found_back_ = found_back_ << 4 | back;
      find_near(recent_[back]);
      return code_near(coder, recent_[back], Coder::encoding ? near_.place_of(cell) : nothing);
    }
    history_ <<= 2;
    found_back_ = found_back_ << 4 | 15;
    return left_->count() == 0 ? nothing : static_cast<uint32_t>(left_->code(coder, cell));
  }

  /// Encoder: the latest of the last cells that this one is near to. A cell without a common point cannot be,
  /// which spares most of the lists.
  unsigned find_recent(uint32_t cell) {
    const auto nodes = nodes_of(cell);
    const auto has = [&](uint32_t point) {
      return std::find(nodes.begin(), nodes.end(), point) != nodes.end();
    };
    for (unsigned back = 0; back < most_recent && recent_[back] != nothing; ++back) {
      const auto others = nodes_of(recent_[back]);
      if (recent_[back] + 1 != cell && std::none_of(others.begin(), others.end(), has)) continue;
      find_near(recent_[back]);
      if (near_.place_of(cell) != nothing) return back;
    }
    return most_recent;
  }
  void find_near(uint32_t base) {
    find_beside(base);
    find_others(base);
  }
  // A cell all of whose points are done with has no cell near it.
  bool has_waiting(uint32_t cell) const {
    if (cell == nothing) return false;
    const auto nodes = nodes_of(cell);
    return std::any_of(nodes.begin(), nodes.end(),
                       [&](uint32_t point) { return waiting_[point] != 0 && can_lead(point); });
  }
  void find_beside(uint32_t base) {
    near_.clear();
    if (base != nothing) {
      add_near(base + uint64_t{1});
      for (const uint32_t cell : (*neighbours_)[base]) add_near(cell);
    }
    beside_ = near_.size();
  }
  /// Points that are done with, or crowded, are passed over. Lists are asked for ahead, as they lie anywhere
  /// in memory.
  void find_others(uint32_t base) {
    if (base == nothing) return;
    for (const uint32_t point : nodes_of(base)) __builtin_prefetch(around_[point].data());
    for (const uint32_t point : nodes_of(base)) {
      if (waiting_[point] == 0 || !can_lead(point)) continue;
      for (const FlatCells::Use& use : around_[point]) add_near(use.cell - first_);
    }
  }
  void add_near(uint64_t cell) {
    if (cell < size_ && left_->has(cell)) near_.add(static_cast<uint32_t>(cell));
  }
  /// Which of the cells near `base`: each is asked about but the last one.
  uint32_t code_near(Coder& coder, uint32_t base, uint32_t chosen) {
    const auto count = static_cast<uint32_t>(near_.size());
    for (uint32_t i = 0; i < count; ++i) {
      const uint32_t cell = near_[i].which;
      uint32_t face = 7;
      for (uint32_t f = 0; f < most_faces; ++f) {
        if ((*neighbours_)[base][f] == cell) face = f;
      }
      const uint32_t local = face | std::min<uint32_t>(i, 7) << 3 | (cell == base + 1 ? 64u : 0) |
                             std::min<uint32_t>(near_[i].met, 7) << 7;
      const Evidence which{local, mixed_ ? rank_of(cell) : 0, count, history_ & 255};
      if (i + 1 < count && !decisions_.code(coder, i == chosen, this_one, which)) continue;
      last_rank_ = local;
      return cell;
    }
    return nothing;
  }

  /// How far above `at_` the next point of a cell is.
  uint32_t rank_of(uint32_t cell) const {
    uint64_t least = ~uint64_t{0};
    for (const uint32_t point : nodes_of(cell)) {
      if (point >= at_) least = std::min<uint64_t>(least, point - at_);
    }
    return size_class(least);
  }
  uint32_t waiting_at(uint64_t point) const {
    if (point >= waiting_.size() || waiting_[point] == 0 || !can_lead(point)) return 0;
    return std::min<uint32_t>(waiting_[point], 15);
  }

  /// A leader has a point that is not below that of the leader before. One may lie far above: then the
  /// difference is told, which must stay below the number of points.
  uint32_t code_led(Coder& coder, uint32_t cell, uint64_t leader) {
    const bool leap = decisions_.code(coder, Coder::encoding && leader - at_ >= reach, leaps, {});
    if (leap) {
      const int64_t by = leap_.code(coder, static_cast<int64_t>(leader - at_));
      if (by < 0 || static_cast<uint64_t>(by) >= waiting_.size() - at_) return nothing;
      at_ += static_cast<uint64_t>(by);
    }
    for (uint64_t gap = 0; gap < reach && at_ + gap < waiting_.size(); ++gap) {
      const uint32_t count = waiting_at(at_ + gap);
      if (count == 0) continue;
      const uint32_t found = code_at_point(coder, cell, leap || at_ + gap == leader, gap, count);
      if (found == nothing) continue;
      at_ += gap;
      if (gap > 0) fetch_ahead();
      return found;
    }
    return nothing;
  }
  /// Leaders go up by a point or two, but what is asked about cells at these lies anywhere in memory.
  void fetch_ahead() const {
    if (at_ + 3 >= around_.size()) return;
    __builtin_prefetch(around_[at_ + 3].data());
    if (!can_lead(at_ + 2)) return;
    for (const FlatCells::Use& use : around_[at_ + 2]) {
      __builtin_prefetch(cells_.nodes_of_cell(use.cell).data());
      if (use.cell - first_ < size_) __builtin_prefetch(&(*neighbours_)[use.cell - first_]);
    }
  }
  /// Which of the cells at the point `gap` above at_ comes; nothing: none of them. How many of its points are
  /// lower tells whether the point is likely to lead the cell: generators sort by the lowest one.
  uint32_t code_at_point(Coder& coder, uint32_t cell, bool here, uint64_t gap, uint32_t count) {
    uint32_t rank = 0;
    for (const FlatCells::Use& use : around_[at_ + gap]) {
      const uint64_t other = use.cell - first_;
      if (other >= size_ || !left_->has(other)) continue;
      uint32_t lower = 0;
      for (const uint32_t point : nodes_of(other)) lower += point < at_ + gap;
      const uint32_t local = static_cast<uint32_t>(gap == 0) | count << 1 | lower << 5;
      const Evidence which{local, rank << 4 | count, size_class(gap), history_ & 255};
      ++rank;
      if (!decisions_.code(coder, other == cell && here, at_point, which)) continue;
      return static_cast<uint32_t>(other);
    }
    return nothing;
  }

  const FlatCells& cells_;
  std::vector<std::span<const FlatCells::Use>> around_;  ///< by point, as the input numbers it
  uint64_t first_ = 0, size_ = 0;
  Remaining* left_ = nullptr;
  const Neighbours* neighbours_ = nullptr;
  std::vector<uint32_t> waiting_;  ///< by point, as the input numbers it: uses in cells that are left
  MetList<64> near_;
  size_t beside_ = 0;  ///< of them, those that follow or share a face
  bool mixed_;
  Decisions<question_count> decisions_;
  DifferenceModel leap_;
  uint64_t at_ = 0;
  std::array<uint32_t, most_recent> recent_;  ///< the last one first
  uint32_t history_ = 0, last_rank_ = 0;
  uint32_t found_back_ = 0;  ///< from which of these the cells before were found, four bits each
};

/// What both directions look things up in: cells in coded order, with points in coded order. Everything here
/// follows from the decoded mesh alone.
struct CodedMesh {
  FlatCells cells;
  std::vector<uint8_t> on_border;
  std::vector<Neighbours> neighbours;  ///< by block

  CodedMesh(const std::vector<CellBlock>& blocks, uint64_t points)
      : cells(blocks, points), on_border(points) {
    for (const CellBlock& block : blocks) neighbours.push_back(neighbours_of(block, &on_border));
  }
};

/// A point for each of the most cells for which it can go up from cell to cell, never falling; nothing for
/// the others. It is the longest such subsequence, with one of several values at each place, found by the
/// ends of the sequences of each length (Fredman 1975), in n log n steps. 45 to 86 % of the cells of
/// scattered files lead so, and 3 to 4 % of cells in random order (docs/history.md).
template <class CanLead>
std::vector<uint32_t> leaders_of(const CellBlock& block, CanLead can_lead) {
  struct Link {
    uint32_t cell, point, before;
  };
  std::vector<Link> links;
  // All points of one cell are looked up before any is entered, as a cell has one place in the sequence;
  // highest first, so that a lower one can still replace it.
  std::vector<uint32_t> least, lowest;  // by length: the link that ends lowest, and where that is
  std::vector<uint32_t> points, ends;
  for (uint64_t i = 0; i < block.size(); ++i) {
    points.clear();
    for (const uint32_t point : block.cell(i)) {
      if (!can_lead(point)) continue;
      size_t at = points.size();
      points.push_back(point);
      for (; at > 0 && points[at - 1] < point; --at) points[at] = points[at - 1];
      points[at] = point;
    }
    ends.clear();
    const size_t first_new = links.size();
    for (const uint32_t point : points) {
      const auto end =
          static_cast<uint32_t>(std::upper_bound(lowest.begin(), lowest.end(), point) - lowest.begin());
      ends.push_back(end);
      links.push_back({static_cast<uint32_t>(i), point, end == 0 ? nothing : least[end - 1]});
    }
    for (size_t k = 0; k < points.size(); ++k) {
      const auto link = static_cast<uint32_t>(first_new + k);
      if (ends[k] == least.size()) {
        least.push_back(link);
        lowest.push_back(points[k]);
      } else if (points[k] < lowest[ends[k]]) {
        least[ends[k]] = link;
        lowest[ends[k]] = points[k];
      }
    }
  }
  std::vector<uint32_t> leader(block.size(), nothing);
  for (uint32_t link = least.empty() ? nothing : least.back(); link != nothing; link = links[link].before)
    leader[links[link].cell] = links[link].point;
  return leader;
}

/// Cells of a block at the places that `place` gives: the k-th comes from place[k], turned as `turns` says.
CellBlock rearranged(const CellBlock& block, const std::vector<uint64_t>& place,
                     std::span<const uint8_t> turns = {}) {
  CellBlock out = block;
  if (place.empty()) return out;
  out.connectivity.clear();
  std::array<uint32_t, most_corners> room;
  for (uint64_t i = 0; i < block.size(); ++i) {
    const auto points = turned_points(block, place[i], turns, room);
    out.connectivity.insert(out.connectivity.end(), points.begin(), points.end());
    if (!out.types.empty()) out.types[i] = block.types[place[i]];
    if (!out.offsets.empty()) out.offsets[i + 1] = out.connectivity.size();
  }
  return out;
}

/// Numbers of points in the order in which coded cells meet them, which is how a decoder numbers them; those
/// without cells behind, in order.
std::vector<uint32_t> sequence_of_points(const std::vector<CellBlock>& blocks, const CellOrders& orders,
                                         const CellTurns& turns, uint64_t points) {
  std::vector<uint32_t> number(points, nothing);
  std::array<uint32_t, most_corners> room;
  uint32_t next = 0;
  for (size_t b = 0; b < blocks.size(); ++b) {
    const CellBlock& block = blocks[b];
    for (uint64_t at = 0; at < block.size(); ++at) {
      const uint64_t i = orders[b].empty() ? at : orders[b][at];
      const CellShape& shape = cell_shapes[kind_of(block.type_of(i))];
      const auto nodes = turned_points(block, i, turns[b], room);
      for (unsigned k = 0; k < shape.nodes; ++k) {
        uint32_t& of = number[nodes[shape.place[k]]];
        if (of == nothing) of = next++;
      }
    }
  }
  for (uint32_t& of : number) {
    if (of == nothing) of = next++;
  }
  return number;
}

/// A permutation of `size` elements, `first` being the least: each as its difference from the one after that
/// before. False: damaged. Elements that come twice are refused, so that what is decoded is a permutation.
template <class Coder>
bool code_permutation(Coder& coder, ResidualModel<64>& model, uint64_t first, uint64_t size,
                      std::vector<uint32_t>& elements) {
  std::vector<bool> seen(size);
  uint64_t expected = 0;
  unsigned length = 0;
  for (uint64_t i = 0; i < size; ++i) {
    int64_t apart = 0;
    if constexpr (Coder::encoding) apart = static_cast<int64_t>(elements[i] - first - expected);
    const ResidualContext context = {2 * length, 0};
    length = model.code_length(coder, bit_length(static_cast<uint64_t>(apart < 0 ? -apart : apart)), 0,
                               context, 0);
    apart = model.code_value(coder, apart, length, 0, 0);
    // Differences wrap; what lies outside is refused below.
    const uint64_t element = expected + static_cast<uint64_t>(apart);
    if constexpr (!Coder::encoding) {
      if (element >= size || seen[element] || coder.exhausted()) return false;
      seen[element] = true;
      elements.push_back(static_cast<uint32_t>(first + element));
    }
    expected = element + 1;
  }
  return true;
}

// Lists of candidates are made once, for the largest block.
uint64_t largest_size(const std::vector<CellBlock>& blocks) {
  uint64_t most = 0;
  for (const CellBlock& block : blocks) most = std::max(most, block.size());
  return most;
}

// Element i comes from place[i].
void rearrange(Array& array, const std::vector<uint32_t>& place) {
  const size_t size = array.tuple_size();
  std::vector<std::byte> bytes(array.bytes.size());
  for (size_t i = 0; i < place.size(); ++i)
    std::copy_n(array.bytes.data() + place[i] * size, size, bytes.data() + i * size);
  array.bytes = std::move(bytes);
}

}  // namespace

std::vector<uint32_t> inverse(const std::vector<uint32_t>& sequence) {
  std::vector<uint32_t> places(sequence.size());
  for (size_t i = 0; i < sequence.size(); ++i) places[sequence[i]] = static_cast<uint32_t>(i);
  return places;
}

// Polyhedra, polygons of any size and loose cells have none.
bool all_have_shapes(const Mesh& mesh) {
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      if (kind_of(block.type_of(i)) >= shape_count) return false;
    }
  }
  return true;
}

// A value behind those of Mixing, and a bit above all of them.
constexpr uint8_t plain_order = mixing_count, points_only_bit = 4;

std::vector<std::byte> join_order(const CodedOrder& order) {
  ByteWriter out;
  const unsigned how = order.plain ? plain_order : static_cast<unsigned>(order.mixing);
  out.put(static_cast<uint8_t>(how | (order.points_only ? points_only_bit : 0u)));
  out.put_count(order.points.size());
  out.put_bytes(order.points);
  out.put_bytes(order.cells);
  return out.take();
}

std::optional<CodedOrder> split_order(Bytes bytes) {
  ByteReader in(bytes);
  const auto how = in.get<uint8_t>();
  const bool points_only = (how & points_only_bit) != 0;
  const unsigned mixing = how & ~unsigned{points_only_bit};
  const Bytes points = in.get_bytes(in.get_count()), cells = in.get_bytes(in.remaining());
  if (!in.ok() || mixing > plain_order || (points_only && !cells.empty())) return {};
  const bool plain = mixing == plain_order;
  return CodedOrder{plain ? Mixing::none : static_cast<Mixing>(mixing),
                    plain,
                    points_only,
                    {points.begin(), points.end()},
                    {cells.begin(), cells.end()}};
}

CodedOrder encode_order(const Mesh& mesh, const CellOrders& orders, const CellTurns& turns, Mixing mixing,
                        bool points_only) {
  std::vector<CellBlock> blocks;
  for (size_t b = 0; b < mesh.blocks.size(); ++b)
    blocks.push_back(rearranged(mesh.blocks[b], orders[b], turns[b]));
  std::vector<uint32_t> sequence = sequence_of_points(mesh.blocks, orders, turns, mesh.point_count());
  for (CellBlock& block : blocks) {
    for (uint32_t& point : block.connectivity) point = sequence[point];
  }
  CodedMesh coded(blocks, mesh.point_count());
  RangeEncoder points, cells;
  PointOrder<RangeEncoder>(coded.cells, coded.on_border, mesh.point_count(), mixing)
      .code(points, sequence, mesh.point_count());
  if (points_only) return {mixing, false, true, points.finish(), {}};
  coded.cells.renumber(inverse(sequence));
  CellSequence<RangeEncoder> order(coded.cells, sequence, largest_size(blocks), mixing);
  uint64_t first = 0;
  for (size_t b = 0; b < blocks.size(); ++b) {
    const uint64_t size = blocks[b].size();
    std::vector<uint32_t> places(size);
    for (size_t i = 0; i < size; ++i) places[orders[b].empty() ? i : orders[b][i]] = static_cast<uint32_t>(i);
    const auto can_lead = [&](uint32_t point) { return order.can_lead(point); };
    order.code(cells, first, size, coded.neighbours[b], leaders_of(mesh.blocks[b], can_lead), places);
    first += size;
  }
  return {mixing, false, false, points.finish(), cells.finish()};
}

/// A few bits an element more than encode_order(), and nothing to look up: two to three times as fast
/// (docs/history.md, "Unstructured at effort 2").
CodedOrder encode_plain_order(const Mesh& mesh, const CellOrders& orders, const CellTurns& turns,
                              bool points_only) {
  std::vector<uint32_t> sequence = sequence_of_points(mesh.blocks, orders, turns, mesh.point_count());
  RansEncoder points, cells;
  ResidualModel<64> of_points, of_cells;
  code_permutation(points, of_points, 0, sequence.size(), sequence);
  if (points_only) return {Mixing::none, true, true, points.finish(), {}};
  std::vector<uint32_t> places;
  for (size_t b = 0; b < orders.size(); ++b) {
    places.resize(mesh.blocks[b].size());
    for (size_t i = 0; i < places.size(); ++i)
      places[orders[b].empty() ? i : orders[b][i]] = static_cast<uint32_t>(i);
    code_permutation(cells, of_cells, 0, places.size(), places);
  }
  return {Mixing::none, true, false, points.finish(), cells.finish()};
}

namespace {

/// Cells stand in the coded order already.
InputOrder keep_cells(const Mesh& mesh, InputOrder found) {
  found.cells.resize(mesh.cell_count());
  std::iota(found.cells.begin(), found.cells.end(), 0u);
  return found;
}

std::optional<InputOrder> decode_plain_order(const Mesh& mesh, const CodedOrder& order) {
  InputOrder found;
  RansDecoder points(order.points), cells(order.cells);
  ResidualModel<64> of_points, of_cells;
  if (!code_permutation(points, of_points, 0, mesh.point_count(), found.points)) return {};
  if (order.points_only) return keep_cells(mesh, std::move(found));
  uint64_t first = 0;
  for (const CellBlock& block : mesh.blocks) {
    if (!code_permutation(cells, of_cells, first, block.size(), found.cells)) return {};
    first += block.size();
  }
  return found;
}

}  // namespace

std::optional<InputOrder> decode_order(const Mesh& mesh, const CodedOrder& order) {
  if (order.plain) return decode_plain_order(mesh, order);
  InputOrder found;
  RangeDecoder points(order.points), cells(order.cells);
  const uint64_t count = mesh.point_count();
  CodedMesh coded(mesh.blocks, count);
  if (!PointOrder<RangeDecoder>(coded.cells, coded.on_border, count, order.mixing)
           .code(points, found.points, count))
    return {};
  if (order.points_only) return keep_cells(mesh, std::move(found));
  coded.cells.renumber(inverse(found.points));
  CellSequence<RangeDecoder> sequence(coded.cells, found.points, largest_size(mesh.blocks), order.mixing);
  uint32_t first = 0;
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    std::vector<uint32_t> places;
    if (!sequence.code(cells, first, mesh.blocks[b].size(), coded.neighbours[b], {}, places)) return {};
    for (const uint32_t place : places) found.cells.push_back(first + place);
    first += static_cast<uint32_t>(places.size());
  }
  return found;
}

/// All arrays are moved by copies, one at a time.
bool restore_order(Mesh& mesh, const CodedOrder& order) {
  const auto found = decode_order(mesh, order);
  if (!found) return false;
  rearrange(mesh.points, found->points);
  for (Array& array : mesh.arrays) {
    if (array.domain == Domain::point) rearrange(array, found->points);
    if (array.domain == Domain::cell) rearrange(array, found->cells);
  }
  const std::vector<uint32_t> number = inverse(found->points);
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
