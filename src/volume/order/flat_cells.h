#pragma once

// What orders of cells and points are coded with: cells and the cells around points in flat lists, what is
// left of many things, and lists of candidates.

#include <maille/mesh.h>

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "volume/cells/cell_shape.h"
#include "volume/cells/decisions.h"

namespace maille {

inline constexpr uint32_t nothing = 0xffffffff;

/// A number below `count`, each as probable as any other. Numbers of more than 12 bits are told in two parts,
/// as a coder divides a range into 2^16 at most. `count` is above 0. docs/format.md, 16.10, "Left over".
template <class Coder>
uint64_t code_uniform(Coder& coder, uint64_t value, uint64_t count) {
  // The first 12 bits with their share of 2^16, the rest as it is; among the last ones, if fewer, again.
  uint64_t base = 0;
  while (count > 1) {
    const unsigned bits = bit_length(count - 1), rest = bits > 12 ? bits - 12 : 0;
    const uint64_t digits = ((count - 1) >> rest) + 1;
    const auto begin_of = [&](uint64_t digit) { return static_cast<uint32_t>((digit << 16) / digits); };
    uint64_t digit = (value - base) >> rest;
    if constexpr (Coder::encoding) {
      coder.put(begin_of(digit), begin_of(digit + 1) - begin_of(digit), 16, 0);
    } else {
      const uint32_t slot = coder.peek(16, 0);
      digit = slot * digits >> 16;
      // The quotient may be too small by one part, because begins of parts are rounded down.
      while (begin_of(digit + 1) <= slot) ++digit;
      coder.advance(begin_of(digit), begin_of(digit + 1) - begin_of(digit), 16, 0);
    }
    base += digit << rest;
    count -= digit << rest;
    if (rest == 0) return base;
    // The last digit stands for fewer numbers than the others: among these one goes on.
    if (count < uint64_t{1} << rest) continue;
    const uint64_t low = (value - base) & ((uint64_t{1} << rest) - 1);
    const unsigned upper = rest > 10 ? rest - 10 : 0;
    base += uint64_t{coder.code_raw(static_cast<uint32_t>(low >> (rest - upper)), upper)} << (rest - upper);
    return base + coder.code_raw(static_cast<uint32_t>(low & ((1u << (rest - upper)) - 1)), rest - upper);
  }
  return base;
}

/// Which of many things are left, so that one of them costs log2 of how many: bits, and sums of them (Fenwick
/// 1994). All operations take log steps. At most 2^32 things.
class Remaining {
 public:
  explicit Remaining(uint64_t count) : bits_(count / 64 + 1), sums_(count / 64 + 2), count_(count) {
    for (uint64_t i = 0; i < count; ++i) bits_[i / 64] |= uint64_t{1} << i % 64;
    while (2 * top_ < sums_.size()) top_ *= 2;
    for (size_t i = 1; i < sums_.size(); ++i) {
      sums_[i] += static_cast<uint32_t>(__builtin_popcountll(bits_[i - 1]));
      if (i + (i & -i) < sums_.size()) sums_[i + (i & -i)] += sums_[i];
    }
  }
  /// Safe for any number.
  bool has(uint64_t i) const { return i / 64 < bits_.size() && (bits_[i / 64] >> i % 64 & 1) != 0; }
  uint64_t count() const { return count_; }
  void remove(uint64_t i) {
    bits_[i / 64] &= ~(uint64_t{1} << i % 64);
    --count_;
    for (size_t at = i / 64 + 1; at < sums_.size(); at += at & -at) --sums_[at];
  }
  /// Codes one of those that are left, by its rank; the caller removes it. There must be one.
  template <class Coder>
  uint64_t code(Coder& coder, uint64_t which) const {
    uint64_t rank = Coder::encoding ? rank_of(which) : 0;
    rank = code_uniform(coder, rank, count_);
    return Coder::encoding ? which : find(rank);
  }

 private:
  /// How many are left below i.
  uint64_t rank_of(uint64_t i) const {
    uint64_t rank =
        static_cast<uint64_t>(__builtin_popcountll(bits_[i / 64] & ((uint64_t{1} << i % 64) - 1)));
    for (size_t at = i / 64; at > 0; at -= at & -at) rank += sums_[at];
    return rank;
  }
  /// Inverse: down the tree of sums, then bit by bit in a word.
  uint64_t find(uint64_t rank) const {
    size_t word = 0;
    for (size_t step = top_; step > 0; step /= 2) {
      if (word + step < sums_.size() && sums_[word + step] <= rank) rank -= sums_[word += step];
    }
    uint64_t bits = bits_[word];
    for (; rank > 0; --rank) bits &= bits - 1;
    return word * 64 + static_cast<uint64_t>(__builtin_ctzll(bits));
  }

  std::vector<uint64_t> bits_;
  std::vector<uint32_t> sums_;
  uint64_t count_;
  // The largest power of two that is no larger than the list of sums: where find() begins.
  size_t top_ = 1;
};

/// The cells of all blocks as slices of one list of points, and the cells around each point, in the order of
/// cells, in a cell in that of nodes: about 12 bytes a node. That order is part of the format of orders
/// (16.10).
class FlatCells {
 public:
  struct Use {
    uint32_t cell;
    uint32_t node;
  };

  // All cells have shapes. Counts first, then sums, then the uses at their places: no list grows.
  FlatCells(const std::vector<CellBlock>& blocks, uint64_t points) : around_(points + 1) {
    for (const CellBlock& block : blocks) add(block);
    begin_.push_back(nodes_.size());
    drop_even_begins();
    uses_.resize(nodes_.size());
    for (uint64_t i = 0; i < points; ++i) around_[i + 1] += around_[i];
    std::vector<uint64_t> end(around_.begin(), around_.end() - 1);
    for (uint32_t cell = 0; cell < kinds_.size(); ++cell) {
      const auto nodes = nodes_of_cell(cell);
      for (uint32_t i = 0; i < nodes.size(); ++i) uses_[end[nodes[i]]++] = {cell, i};
    }
  }
  /// Nodes as cell_shapes number them.
  std::span<const uint32_t> nodes_of_cell(uint64_t cell) const {
    if (each_ != 0) return std::span(nodes_).subspan(cell * each_, each_);
    return std::span(nodes_).subspan(begin_[cell], begin_[cell + 1] - begin_[cell]);
  }
  const CellShape& shape_of(uint64_t cell) const { return cell_shapes[kinds_[cell]]; }
  std::span<const Use> around(uint64_t point) const {
    return std::span(uses_).subspan(around_[point], around_[point + 1] - around_[point]);
  }
  /// Nodes are told by other numbers from now on; around() keeps to those before.
  void renumber(const std::vector<uint32_t>& number) {
    for (uint32_t& node : nodes_) node = number[node];
  }

 private:
  void add(const CellBlock& block) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto points = block.cell(i);
      const unsigned kind = kind_of(block.type_of(i));
      kinds_.push_back(static_cast<uint8_t>(kind));
      begin_.push_back(nodes_.size());
      for (unsigned k = 0; k < points.size(); ++k) {
        nodes_.push_back(points[cell_shapes[kind].place[k]]);
        ++around_[nodes_.back() + uint64_t{1}];
      }
    }
  }

  /// Drops the list of begins where all cells have as many nodes: looking up where the nodes of a cell begin
  /// is one miss of the cache more for each cell.
  void drop_even_begins() {
    if (kinds_.empty()) return;
    const uint64_t each = begin_[1];
    for (size_t cell = 1; cell < kinds_.size(); ++cell) {
      if (begin_[cell + 1] - begin_[cell] != each) return;
    }
    each_ = each;
    begin_ = {};
  }

  std::vector<uint32_t> nodes_;
  std::vector<uint64_t> begin_;  ///< by cell; empty where each_ tells
  uint64_t each_ = 0;            ///< nodes of each cell where all have as many, else 0
  std::vector<uint8_t> kinds_;
  std::vector<uint64_t> around_;
  std::vector<Use> uses_;
};

/// Values in classes of contexts: exact below 4, then by number of bits.
inline uint32_t size_class(uint64_t value) {
  return value < 4 ? static_cast<uint32_t>(value) : 2 + bit_length(value);
}

/// Things of which each is listed once, with how often it was met, in the order in which they were met first.
/// Only the first `Most` are listed; clearing costs as much as is listed, not the range.
template <size_t Most>
class MetList {
 public:
  struct Item {
    uint32_t which;
    uint32_t met;
  };
  explicit MetList(uint64_t range) : places_(range) {}

  size_t size() const { return count_; }
  const Item& operator[](size_t i) const { return items_[i]; }
  void add(uint32_t which, uint32_t times = 1) {
    uint16_t& place = places_[which];
    if (place != 0) {
      items_[place - 1u].met += times;
    } else if (count_ < Most) {
      items_[count_++] = {which, times};
      place = static_cast<uint16_t>(count_);
    }
  }
  /// `nothing` where it is not listed.
  uint32_t place_of(uint32_t which) const { return places_[which] - 1u; }
  std::span<const Item> items() const { return std::span(items_).first(count_); }
  void clear() {
    for (size_t i = 0; i < count_; ++i) places_[items_[i].which] = 0;
    count_ = 0;
  }

 private:
  std::vector<uint16_t> places_;  ///< 1 + place in items_
  std::array<Item, Most> items_;
  size_t count_ = 0;
};

/// Calls visit(point) for the points that an edge joins to one, or else those that share a cell with it
/// (itself included), of at most 48 cells around it.
template <class Visit>
void for_each_beside(const FlatCells& cells, uint32_t point, bool joined, Visit visit) {
  const auto all = cells.around(point);
  const auto uses = all.first(std::min<size_t>(all.size(), 48));
  for (const FlatCells::Use& use : uses) __builtin_prefetch(cells.nodes_of_cell(use.cell).data());
  for (const FlatCells::Use& use : uses) {
    const CellShape& shape = cells.shape_of(use.cell);
    if (use.node >= shape.corners) continue;
    const auto nodes = cells.nodes_of_cell(use.cell);
    const unsigned corners = (1u << shape.corners) - 1, near = shape.neighbours[use.node];
    for (unsigned some = joined ? near : corners & ~near; some != 0; some &= some - 1)
      visit(nodes[static_cast<unsigned>(__builtin_ctz(some))]);
  }
}

}  // namespace maille
