#include "volume/ranks/cut_among_ranks.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "base/bytes.h"
#include "base/sort_unique.h"
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

/// A range that may be cut across an axis. Keys are the coordinate along the axis, then the number of the
/// cell, so that no two are the same and the order is that of the one process's sort.
struct Cut {
  size_t range = 0;
  unsigned axis = 0;
  CutPlace place;
  std::vector<uint64_t> keys;    ///< of this rank, rising
  uint64_t first = 0, last = 0;  ///< keys of the cells place.first - 1 and place.last - 1
  uint64_t key = 0;              ///< the first one above the cut
  uint64_t below = 0;            ///< cells of all ranks below
  float low = 0, high = 0;       ///< where the cells on either side of the cut are
};

/// Finds cuts level by level. Each level takes a fixed number of messages, whatever the number of ranges:
/// boxes (1), selection (16), one exchange for each axis that a range may be cut across, and one to choose.
class Cutter {
 public:
  Cutter(const std::vector<Middle>& cells, const CutPosition& reach, Ranks& ranks)
      : cells_(cells), reach_(reach), ranks_(ranks), order_(cells.size()) {
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
    std::vector<Cut> cuts = possible_cuts();
    for (Cut& cut : cuts) sort_keys(cut);
    select(cuts);
    for (Cut& cut : cuts) find_place(cut);
    divide(best_of(cuts));
  }

  /// A cut for each axis that each range may be cut across.
  std::vector<Cut> possible_cuts() {
    std::vector<size_t> open;
    for (size_t i = 0; i < ranges_.size(); ++i) {
      if (!ranges_[i].is_done()) open.push_back(i);
    }
    const std::vector<uint64_t> ends = ends_of(open);
    std::vector<Cut> cuts;
    for (size_t i = 0; i < open.size(); ++i) {
      CutPosition low, high;
      for (unsigned k = 0; k < 3; ++k) {
        high[k] = float_of(static_cast<uint32_t>(ends[6 * i + k]));
        low[k] = float_of(static_cast<uint32_t>(0xffffffff - ends[6 * i + 3 + k]));
      }
      for (const unsigned axis : AxesToTry(low, high)) {
        Cut& cut = cuts.emplace_back();
        cut.range = open[i];
        cut.axis = axis;
        cut.place = cut_place(ranges_[open[i]].cells, ranges_[open[i]].pieces);
      }
    }
    return cuts;
  }

  /// The box of each of these ranges over all ranks. Ranks know the largest of numbers only: behind the
  /// largest numbers of a range stand the complements of the least.
  std::vector<uint64_t> ends_of(const std::vector<size_t>& ranges) {
    std::vector<uint64_t> ends(ranges.size() * 6);
    for (size_t r = 0; r < ranges.size(); ++r) {
      const Range& range = ranges_[ranges[r]];
      for (size_t i = range.begin; i < range.end; ++i) {
        for (unsigned k = 0; k < 3; ++k) {
          const uint64_t x = ordered(cells_[order_[i]].at[k]);
          ends[6 * r + k] = std::max(ends[6 * r + k], x);
          ends[6 * r + 3 + k] = std::max(ends[6 * r + 3 + k], 0xffffffff - x);
        }
      }
    }
    ranks_.largest(ends);
    return ends;
  }

  /// Of the cuts of each range the first one with the fewest cells near it.
  std::vector<Cut> best_of(std::vector<Cut>& cuts) {
    std::vector<uint64_t> near;
    for (const Cut& cut : cuts) {
      const float reach = reach_[cut.axis];
      near.push_back(static_cast<uint64_t>(std::count_if(cut.keys.begin(), cut.keys.end(), [&](uint64_t key) {
        return is_near(coordinate_of(key), cut.low, cut.high, reach);
      })));
    }
    ranks_.add(near);
    std::vector<Cut> best;
    uint64_t least = 0;
    for (size_t c = 0; c < cuts.size(); ++c) {
      const bool is_first = best.empty() || best.back().range != cuts[c].range;
      if (is_first) best.emplace_back();
      if (!is_first && near[c] >= least) continue;
      least = near[c];
      best.back() = std::move(cuts[c]);
    }
    return best;
  }

  uint64_t key_of(size_t cell, unsigned axis) const {
    return uint64_t{ordered(cells_[cell].at[axis])} << 32 | cells_[cell].cell;
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
        cuts[c].first |= last_within(counts, cuts[c].place.first - 1) << shift;
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

  static float coordinate_of(uint64_t key) { return float_of(static_cast<uint32_t>(key >> 32)); }

  /// The best place among the cells near the middle, which all ranks send to all: a layer of the mesh, or a
  /// quarter of a piece on either side. One cell more than the place needs: the one below the first.
  void find_place(Cut& cut) {
    const auto begin = std::lower_bound(cut.keys.begin(), cut.keys.end(), cut.first);
    const auto end = std::upper_bound(begin, cut.keys.end(), cut.last);
    ByteWriter mine;
    for (auto key = begin; key != end; ++key) mine.put(*key);
    std::vector<uint64_t> keys;
    for (const auto& buffer : to_all(ranks_, mine.bytes())) {
      for (ByteReader in(buffer); in.remaining() > 0;) keys.push_back(in.get<uint64_t>());
    }
    std::sort(keys.begin(), keys.end());
    const uint64_t before = cut.place.first - 1;
    const auto key_at = [&](uint64_t i) { return keys[static_cast<size_t>(i - before)]; };
    cut.below = sparsest_place(cut.place, [&](uint64_t i) { return coordinate_of(key_at(i)); });
    cut.key = key_at(cut.below);
    cut.low = coordinate_of(key_at(cut.below - 1));
    cut.high = coordinate_of(cut.key);
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

  const std::vector<Middle>& cells_;
  CutPosition reach_;
  Ranks& ranks_;
  std::vector<size_t> order_;  ///< cells of this rank, range by range
  std::vector<Range> ranges_;
};

}  // namespace

RankPieces cut_among_ranks(const std::vector<Middle>& cells, const CutPosition& reach, uint64_t target,
                           Ranks& ranks) {
  return Cutter(cells, reach, ranks).run(target);
}

/// Cells have one rank each, and points several, so that points are listed by piece and number and each is
/// counted once.
LookedAt look_among_ranks(const Mesh& part, const RankPieces& pieces, std::span<const uint32_t> points,
                          Ranks& ranks) {
  const std::vector<uint32_t> some = pieces_looked_at(pieces.count);
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
      sort_unique(found);
      most = std::max(many, 2 * found.size());
    }
  }
  sort_unique(found);
  std::vector<uint64_t> all;
  for (const std::vector<std::byte>& bytes : to_all(ranks, std::as_bytes(std::span(found)))) {
    for (size_t at = 0; at < bytes.size(); at += sizeof(uint64_t))
      all.push_back(load<uint64_t>(bytes.data() + at));
  }
  sort_unique(all);
  return {sum_of(ranks, cells), all.size(), sum_of(ranks, flat)};
}

}  // namespace maille
