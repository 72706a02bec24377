#include "volume/pieces/bisection.h"

#include <algorithm>
#include <tuple>

#include "volume/pieces/cut_rules.h"

namespace maille {
namespace {

/// Cells that become so many pieces.
struct Range {
  size_t begin = 0, end = 0;
  uint64_t pieces = 1;
  size_t side = Bisection::no_side;  ///< which it is of its cut
};

unsigned axis_of(const Middle* begin, const Middle* end) {
  std::array<float, 3> low = begin->at, high = begin->at;
  for (const Middle* middle = begin; middle != end; ++middle) {
    for (unsigned k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], middle->at[k]);
      high[k] = std::max(high[k], middle->at[k]);
    }
  }
  return longest_axis(low, high);
}

/// A plane between two middles that follow one another along the axis.
Bisection::Cut cut_between(const Middle& below, const Middle& above, unsigned axis) {
  // Of a lattice a sample may have missed layers between them: a cut must not run through one of these, where
  // rounding would decide. No small multiple of the golden section is near a whole number.
  constexpr float golden = 0.618F;
  const float low = below.at[axis], high = above.at[axis];
  Bisection::Cut cut;
  cut.axis = axis;
  cut.value = low + (high - low) * golden;
  if (!(cut.value > low && cut.value <= high)) cut.value = high;
  cut.cell = low < high ? 0 : above.cell;
  return cut;
}

struct Halves {
  std::array<Range, 2> ranges;
  Bisection::Cut cut;
  bool is_cut = false;
};

/// Puts the cells below the cut before the others.
Halves halve(std::vector<Middle>& middles, const Range& range) {
  Halves halves;
  halves.is_cut = range.pieces > 1 && range.end - range.begin > 1;
  if (!halves.is_cut) return halves;
  Middle* const begin = middles.data() + range.begin;
  Middle* const end = middles.data() + range.end;
  const unsigned axis = axis_of(begin, end);
  const auto before = [axis](const Middle& a, const Middle& b) {
    return std::tie(a.at[axis], a.cell) < std::tie(b.at[axis], b.cell);
  };
  const CutPlace place = cut_place(range.end - range.begin, range.pieces);
  Middle* const first = begin + place.first;
  Middle* const last = begin + place.last;
  std::nth_element(begin, first, end, before);
  std::nth_element(first, last - 1, end, before);
  std::sort(first, last, before);
  const size_t at = range.begin + widest_gap(place, [&](size_t i) { return begin[i].at[axis]; });
  halves.ranges = {Range{range.begin, at, range.pieces / 2},
                   Range{at, range.end, range.pieces - range.pieces / 2}};
  // Those before `first` are in no order.
  const Middle* const below =
      middles.data() + at > first ? middles.data() + at - 1 : std::max_element(begin, first, before);
  halves.cut = cut_between(*below, middles[at], axis);
  return halves;
}

}  // namespace

void Bisection::set_side(size_t side, uint32_t to) {
  if (side != no_side) cuts[side / 2].sides[side % 2] = to;
}

uint32_t Bisection::piece_of(const Middle& middle) const {
  uint32_t at = cuts.empty() ? ~uint32_t{0} : 0;
  while (at < cuts.size()) {
    const Cut& cut = cuts[at];
    const float value = middle.at[cut.axis];
    const bool below = value < cut.value || (value <= cut.value && middle.cell < cut.cell);
    at = cut.sides[below ? 0 : 1];
  }
  return ~at;
}

Bisection bisect(std::vector<Middle> middles, uint64_t pieces, Executor& executor) {
  Bisection found;
  found.middles = std::move(middles);
  if (found.middles.empty()) return found;
  std::vector<Range> ranges = {{0, found.middles.size(), pieces}};
  // All of one depth at once: they have no cells in common.
  for (bool more = true; more;) {
    std::vector<Halves> halves(ranges.size());
    executor.parallel_for(ranges.size(), [&](size_t i) { halves[i] = halve(found.middles, ranges[i]); });
    const std::vector<Range> whole = std::move(ranges);
    ranges.clear();
    more = false;
    for (size_t i = 0; i < halves.size(); ++i) {
      if (!halves[i].is_cut) {
        ranges.push_back(whole[i]);
        continue;
      }
      found.set_side(whole[i].side, static_cast<uint32_t>(found.cuts.size()));
      for (size_t side = 0; side < 2; ++side) {
        Range& range = ranges.emplace_back(halves[i].ranges[side]);
        range.side = 2 * found.cuts.size() + side;
        more = more || (range.pieces > 1 && range.end - range.begin > 1);
      }
      found.cuts.push_back(halves[i].cut);
    }
  }
  for (const Range& range : ranges) {
    found.set_side(range.side, ~static_cast<uint32_t>(found.ends.size()));
    found.ends.push_back(range.end);
  }
  return found;
}

}  // namespace maille
