#include "volume/ranks/cut_among_ranks.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "base/bytes.h"
#include "volume/pieces/cut_rules.h"
#include "volume/ranks/collective.h"

namespace maille {
namespace {

/// Floats as integers in the same order, 0 and -0 as one, as comparisons have it. So selection among ranks
/// works on integers, whose bits can be found one after the other. Middles are finite (cut_rules.cpp).
uint32_t ordered(float x) {
  const auto bits = bits_as<uint32_t>(x + 0.0f);
  return bits >> 31 ? ~bits : bits | 0x80000000u;
}
float float_of(uint32_t order) {
  return bits_as<float>(order >> 31 ? order & 0x7fffffffu : ~order);
}

/// Cells of all ranks that become so many pieces; those of this rank are order_[begin] to order_[end - 1], in
/// any order.
struct Range {
  size_t begin = 0, end = 0;
  uint64_t cells = 0;
  uint64_t pieces = 1;

  bool is_done() const { return pieces < 2 || cells < 2; }
};

/// A range that is being cut. Keys are the coordinate along the axis, then the number of the cell, so that no
/// two are the same and the order is that of the one process's sort.
struct Cut {
  size_t range = 0;
  unsigned axis = 0;
  CutPlace place;
  std::vector<uint64_t> keys;    ///< of this rank, rising
  uint64_t first = 0, last = 0;  ///< keys of the cells place.first and place.last - 1
  uint64_t key = 0;              ///< the first one above the cut
  uint64_t below = 0;            ///< cells of all ranks below
};

/// Finds cuts level by level. Each level takes a fixed number of messages, whatever the number of ranges:
/// boxes (1), selection (16), and one exchange for each cut.
class Cutter {
 public:
  Cutter(const std::vector<CellMiddle>& cells, Ranks& ranks)
      : cells_(cells), ranks_(ranks), order_(cells.size()) {
    std::iota(order_.begin(), order_.end(), size_t{0});
  }

  RankPieces run(uint64_t target) {
    const uint64_t all = sum_of(ranks_, cells_.size());
    if (all > 0) ranges_ = {{0, cells_.size(), all, pieces_of(all, target)}};
    const auto is_done = [](const Range& range) { return range.is_done(); };
    while (!std::all_of(ranges_.begin(), ranges_.end(), is_done)) halve_all();
    RankPieces pieces;
    pieces.count = static_cast<uint32_t>(ranges_.size());
    pieces.of_cell.resize(cells_.size());
    for (uint32_t p = 0; p < ranges_.size(); ++p) {
      for (size_t i = ranges_[p].begin; i < ranges_[p].end; ++i) pieces.of_cell[order_[i]] = p;
    }
    return pieces;
  }

 private:
  /// Halves all ranges of one depth at once, which takes as many messages for boxes and selection as one
  /// alone.
  void halve_all() {
    std::vector<Cut> cuts;
    for (size_t i = 0; i < ranges_.size(); ++i) {
      if (ranges_[i].is_done()) continue;
      Cut& cut = cuts.emplace_back();
      cut.range = i;
      cut.place = cut_place(ranges_[i].cells, ranges_[i].pieces);
    }
    find_axes(cuts);
    for (Cut& cut : cuts) sort_keys(cut);
    select(cuts);
    for (Cut& cut : cuts) find_gap(cut);
    divide(cuts);
  }

  /// The box of each range over all ranks; only the axis is kept.
  void find_axes(std::vector<Cut>& cuts) {
    // Ranks know the largest of numbers only: the least is the complement of the largest complement.
    // Largest numbers, and the complements of the least.
    std::vector<uint64_t> ends(cuts.size() * 6);
    for (size_t c = 0; c < cuts.size(); ++c) {
      const Range& range = ranges_[cuts[c].range];
      for (size_t i = range.begin; i < range.end; ++i) {
        for (unsigned k = 0; k < 3; ++k) {
          const uint64_t x = ordered(cells_[order_[i]].at[k]);
          ends[6 * c + k] = std::max(ends[6 * c + k], x);
          ends[6 * c + 3 + k] = std::max(ends[6 * c + 3 + k], 0xffffffff - x);
        }
      }
    }
    ranks_.largest(ends);
    for (size_t c = 0; c < cuts.size(); ++c) {
      std::array<float, 3> low, high;
      for (unsigned k = 0; k < 3; ++k) {
        high[k] = float_of(static_cast<uint32_t>(ends[6 * c + k]));
        low[k] = float_of(static_cast<uint32_t>(0xffffffff - ends[6 * c + 3 + k]));
      }
      cuts[c].axis = longest_axis(low, high);
    }
  }

  uint64_t key_of(size_t cell, unsigned axis) const {
    return uint64_t{ordered(cells_[cell].at[axis])} << 32 | cells_[cell].number;
  }

  void sort_keys(Cut& cut) const {
    const Range& range = ranges_[cut.range];
    for (size_t i = range.begin; i < range.end; ++i) cut.keys.push_back(key_of(order_[i], cut.axis));
    std::sort(cut.keys.begin(), cut.keys.end());
  }

  /// The keys of the cells that stand at the ends of where a cut may be, among those of all ranks. Each is
  /// the largest number that no more keys are below than there should be, found four bits at a time: 16
  /// rounds of 16 counts instead of 64 rounds of one, as a message takes longer than to count.
  void select(std::vector<Cut>& cuts) {
    constexpr uint64_t digits = 16;
    std::vector<uint64_t> below(cuts.size() * 2 * digits);
    for (unsigned shift = 64; shift > 0;) {
      shift -= 4;
      for (size_t c = 0; c < cuts.size(); ++c) {
        for (uint64_t digit = 0; digit < digits; ++digit) {
          below[2 * (c * digits + digit)] = count_below(cuts[c], cuts[c].first | digit << shift);
          below[2 * (c * digits + digit) + 1] = count_below(cuts[c], cuts[c].last | digit << shift);
        }
      }
      ranks_.add(below);
      for (size_t c = 0; c < cuts.size(); ++c) {
        const uint64_t* const counts = &below[2 * c * digits];
        cuts[c].first |= last_within(counts, cuts[c].place.first) << shift;
        cuts[c].last |= last_within(counts + 1, cuts[c].place.last - 1) << shift;
      }
    }
  }
  /// The last of 16 digits with so many keys below at most; the first digit always has.
  static uint64_t last_within(const uint64_t* counts, uint64_t most) {
    uint64_t digit = 15;
    while (digit > 0 && counts[2 * digit] > most) --digit;
    return digit;
  }
  static uint64_t count_below(const Cut& cut, uint64_t key) {
    return static_cast<uint64_t>(std::lower_bound(cut.keys.begin(), cut.keys.end(), key) - cut.keys.begin());
  }

  /// Where the gap is widest among the cells near the cut, which all ranks send to all: a layer of the mesh,
  /// or a sixteenth of its cells.
  void find_gap(Cut& cut) {
    const auto begin = std::lower_bound(cut.keys.begin(), cut.keys.end(), cut.first);
    const auto end = std::upper_bound(begin, cut.keys.end(), cut.last);
    ByteWriter mine;
    for (auto key = begin; key != end; ++key) mine.put(*key);
    std::vector<uint64_t> keys;
    for (const auto& buffer : to_all(ranks_, mine.bytes())) {
      for (ByteReader in(buffer); in.remaining() > 0;) keys.push_back(in.get<uint64_t>());
    }
    std::sort(keys.begin(), keys.end());
    const uint64_t first = cut.place.first;
    cut.below = widest_gap(cut.place, [&](uint64_t i) {
      return float_of(static_cast<uint32_t>(keys[static_cast<size_t>(i - first)] >> 32));
    });
    cut.key = keys[static_cast<size_t>(cut.below - first)];
  }

  /// Splits each range that was cut, and drops halves without cells. All ranks have the same list of ranges,
  /// also where none of their own cells is in one.
  void divide(const std::vector<Cut>& cuts) {
    std::vector<Range> halves;
    size_t next = 0;
    for (size_t i = 0; i < ranges_.size(); ++i) {
      const Range& range = ranges_[i];
      if (next == cuts.size() || cuts[next].range != i) {
        halves.push_back({range.begin, range.end, range.cells, 1});
        continue;
      }
      const Cut& cut = cuts[next++];
      const auto from = order_.begin();
      const auto middle = std::stable_partition(
          from + static_cast<ptrdiff_t>(range.begin), from + static_cast<ptrdiff_t>(range.end),
          [&](size_t cell) { return key_of(cell, cut.axis) < cut.key; });
      const auto at = static_cast<size_t>(middle - from);
      if (cut.below > 0) halves.push_back({range.begin, at, cut.below, range.pieces / 2});
      if (cut.below < range.cells)
        halves.push_back({at, range.end, range.cells - cut.below, range.pieces - range.pieces / 2});
    }
    ranges_ = std::move(halves);
  }

  const std::vector<CellMiddle>& cells_;
  Ranks& ranks_;
  std::vector<size_t> order_;  ///< cells of this rank, range by range
  std::vector<Range> ranges_;
};

}  // namespace

RankPieces cut_among_ranks(const std::vector<CellMiddle>& cells, uint64_t target, Ranks& ranks) {
  return Cutter(cells, ranks).run(target);
}

/// Cells have one rank each, and points several, so that points are listed by piece and number and each is
/// counted once.
LookedAt look_among_ranks(const Mesh& part, const RankPieces& pieces, std::span<const uint32_t> points,
                          Ranks& ranks) {
  const std::vector<uint32_t> some = pieces_looked_at(pieces.count);
  const auto each_once = [](std::vector<uint64_t>& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  };
  // One million corners, 8 MiB. Growing with what is left keeps the sorting linear in all but a logarithm.
  constexpr size_t many = size_t{1} << 20;  // corners: each point is there for eight cells, so not for long
  size_t most = many;
  uint64_t cells = 0, flat = 0;
  std::vector<uint64_t> found;  // piece, then point
  size_t next = 0;
  for (const CellBlock& block : part.blocks) {
    for (uint64_t i = 0, count = block.size(); i < count; ++i) {
      const uint32_t piece = pieces.of_cell[next++];
      if (!std::binary_search(some.begin(), some.end(), piece)) continue;
      ++cells;
      flat += dimension_of(block.type_of(i)) != 3;
      for (const uint32_t point : block.cell(i)) found.push_back(uint64_t{piece} << 32 | points[point]);
      if (found.size() < most) continue;
      each_once(found);
      most = std::max(many, 2 * found.size());
    }
  }
  each_once(found);
  std::vector<uint64_t> all;
  for (const std::vector<std::byte>& bytes : to_all(ranks, std::as_bytes(std::span(found)))) {
    for (size_t at = 0; at < bytes.size(); at += sizeof(uint64_t))
      all.push_back(load<uint64_t>(bytes.data() + at));
  }
  each_once(all);
  return {sum_of(ranks, cells), all.size(), sum_of(ranks, flat)};
}

}  // namespace maille
