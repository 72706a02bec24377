#include "volume/pieces/bisection.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace maille {
namespace {

/// A stretch of `places` whose cells become so many pieces.
struct Range {
  size_t begin = 0, end = 0;
  uint64_t pieces = 1;
  size_t side = Bisection::no_side;  ///< which it is of its cut

  size_t size() const { return end - begin; }
  bool is_cut() const { return pieces > 1 && size() > 1; }
};

struct BoxOfMiddles {
  std::array<float, 3> low, high;

  void add(const BoxOfMiddles& other) {
    for (unsigned k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], other.low[k]);
      high[k] = std::max(high[k], other.high[k]);
    }
  }
};

/// Where a cell is along the axis; those at one place by their numbers. So the order is total, and a cut can
/// run through cells at one place.
using Along = std::pair<float, uint32_t>;

/// Equal steps along an axis, for a histogram: 1,024 of them make the sorted part a thousandth of the range
/// where cells lie evenly, in 4 KiB for each stretch.
class Steps {
 public:
  static constexpr size_t count = 1024;
  Steps(float low, float high) : low_(low), scale_(static_cast<float>(count) / (high - low)) {
    if (!std::isfinite(scale_)) scale_ = 0;
  }
  /// The step of x, which never falls where x rises, rounding included. `x`: from low to high.
  size_t operator()(float x) const {
    return std::min(static_cast<size_t>(static_cast<int32_t>((x - low_) * scale_)), count - 1);
  }

 private:
  float low_, scale_;
};
using Histogram = std::array<uint32_t, Steps::count>;

/// A plane between two middles that follow one another along the axis. Where both are at one place, the
/// number of the cell decides.
Bisection::Cut cut_between(Along below, Along above, unsigned axis) {
  // Of a lattice a sample may have missed layers between them: a cut must not run through one of these, where
  // rounding would decide. No small multiple of the golden section is near a whole number.
  constexpr float golden = 0.618F;
  const float low = below.first, high = above.first;
  Bisection::Cut cut;
  cut.axis = axis;
  cut.value = low + (high - low) * golden;
  if (!(cut.value > low && cut.value <= high)) cut.value = high;
  cut.cell = low < high ? 0 : above.second;
  return cut;
}

struct Halves {
  std::array<Range, 2> ranges;
  Bisection::Cut cut;
};

/// Halves ranges. What a range needs is found in stretches of so many cells, whoever does them. 65,536 cells:
/// enough work for a task, and small pieces go side by side instead.
class Halver {
 public:
  static constexpr size_t stretch = size_t{1} << 16;

  Halver(std::span<const Middle> middles, const CutPosition& reach, std::vector<uint32_t>& places)
      : middles_(middles), reach_(reach), places_(places), spare_(places.size()) {}

  /// Puts the cells below the cut before the others; both keep their order. Ranges may be halved side by
  /// side, as each uses its own part of the lists.
  Halves halve(const Range& range, Executor& executor) {
    const BoxOfMiddles box = box_of(range, executor);
    Found best;
    AxesToTry axes(box.low, box.high);
    if (reach_ == CutPosition{}) axes.count = 1;
    for (const unsigned axis : axes) {
      const Found found = sparsest(range, axis, Steps(box.low[axis], box.high[axis]), executor);
      if (best.at == 0 || found.cells_near < best.cells_near) best = found;
    }
    part(range, best.axis, best.above, executor);
    const size_t middle = range.begin + best.at;
    return {{Range{range.begin, middle, range.pieces / 2},
             Range{middle, range.end, range.pieces - range.pieces / 2}},
            cut_between(best.below, best.above, best.axis)};
  }

 private:
  /// The best cut across an axis: between these cells, so many of the range below it.
  struct Found {
    unsigned axis = 0;
    size_t at = 0;  ///< at least 1 once it is found
    Along below, above;
    size_t cells_near = 0;
  };

  Found sparsest(const Range& range, unsigned axis, const Steps& steps, Executor& executor) {
    const CutPlace place = cut_place(range.size(), range.pieces);
    uint64_t before = 0;
    const std::vector<Along> near = near_cut(range, axis, steps, place, before, executor);
    const auto cell = [&](uint64_t i) { return near[static_cast<size_t>(i - before)]; };
    const uint64_t at = sparsest_place(place, [&](uint64_t i) { return cell(i).first; });
    Found found = {axis, static_cast<size_t>(at), cell(at - 1), cell(at), 0};
    std::vector<size_t> counts(stretches(range));
    for_stretches(range, executor, [&](size_t i, std::span<const uint32_t> places) {
      counts[i] = static_cast<size_t>(std::count_if(places.begin(), places.end(), [&](uint32_t each) {
        return is_near(middles_[each].at[axis], found.below.first, found.above.first, reach_[axis]);
      }));
    });
    found.cells_near = std::accumulate(counts.begin(), counts.end(), size_t{0});
    return found;
  }

  template <class Work>
  void for_stretches(const Range& range, Executor& executor, Work work) {
    executor.parallel_for(stretches(range), [&](size_t i) {
      const size_t begin = range.begin + i * stretch;
      work(i, std::span(places_).subspan(begin, std::min(stretch, range.end - begin)));
    });
  }
  static size_t stretches(const Range& range) { return (range.size() + stretch - 1) / stretch; }
  Along along(uint32_t place, unsigned axis) const {
    return {middles_[place].at[axis], middles_[place].cell};
  }

  // Boxes of stretches are joined in order; least and largest numbers would be the same in any.
  BoxOfMiddles box_of(const Range& range, Executor& executor) {
    const Middle& any = middles_[places_[range.begin]];
    std::vector<BoxOfMiddles> boxes(stretches(range));
    for_stretches(range, executor, [&](size_t i, std::span<const uint32_t> places) {
      BoxOfMiddles box = {any.at, any.at};
      for (const uint32_t place : places) box.add({middles_[place].at, middles_[place].at});
      boxes[i] = box;
    });
    for (const BoxOfMiddles& box : boxes) boxes[0].add(box);
    return boxes[0];
  }

  /// The cells from the one before place.first to that before place.last, sorted, and some more; `before` is
  /// how many are left out before them. Few need to be sorted, since a histogram tells the steps they are on.
  /// Where all cells are on one step, all of them are looked at, by nth_element in linear time.
  std::vector<Along> near_cut(const Range& range, unsigned axis, const Steps& steps, const CutPlace& place,
                              uint64_t& before, Executor& executor) {
    std::vector<Histogram> counts(stretches(range), Histogram{});
    for_stretches(range, executor, [&](size_t i, std::span<const uint32_t> places) {
      for (const uint32_t each : places) ++counts[i][steps(middles_[each].at[axis])];
    });
    const auto count_of = [&](size_t step) {
      return std::accumulate(counts.begin(), counts.end(), uint64_t{0},
                             [&](uint64_t sum, const Histogram& each) { return sum + each[step]; });
    };
    size_t first = 0;
    for (uint64_t count = 0; (count = count_of(first)) < place.first - before; ++first) before += count;
    size_t last = first;
    for (uint64_t sum = before; (sum += count_of(last)) < place.last;) ++last;
    std::vector<std::vector<Along>> found(counts.size());
    for_stretches(range, executor, [&](size_t i, std::span<const uint32_t> places) {
      for (const uint32_t each : places) {
        const size_t step = steps(middles_[each].at[axis]);
        if (step >= first && step <= last) found[i].push_back(along(each, axis));
      }
    });
    std::vector<Along> near;
    for (const std::vector<Along>& some : found) near.insert(near.end(), some.begin(), some.end());
    const auto from = near.begin() + static_cast<ptrdiff_t>(place.first - before - 1);
    const auto to = near.begin() + static_cast<ptrdiff_t>(place.last - before);
    std::nth_element(near.begin(), from, near.end());
    std::nth_element(from, to - 1, near.end());
    std::sort(from, to);
    return near;
  }

  /// Moves the cells below the cut before the others. Both sides stay in their order: offsets of each stretch
  /// are sums of counts, so that threads write side by side.
  void part(const Range& range, unsigned axis, Along above, Executor& executor) {
    const auto is_below = [&](uint32_t place) { return along(place, axis) < above; };
    std::vector<size_t> ends(stretches(range) + 1);  // of the cells below in each stretch
    for_stretches(range, executor, [&](size_t i, std::span<const uint32_t> places) {
      ends[i + 1] = static_cast<size_t>(std::count_if(places.begin(), places.end(), is_below));
    });
    std::partial_sum(ends.begin(), ends.end(), ends.begin());
    for_stretches(range, executor, [&](size_t i, std::span<const uint32_t> places) {
      uint32_t* to_below = spare_.data() + range.begin + ends[i];
      uint32_t* to_above = spare_.data() + range.begin + ends.back() + i * stretch - ends[i];
      for (const uint32_t place : places) *(is_below(place) ? to_below : to_above)++ = place;
    });
    for_stretches(range, executor, [&](size_t i, std::span<uint32_t> places) {
      std::copy_n(spare_.data() + range.begin + i * stretch, places.size(), places.data());
    });
  }

  std::span<const Middle> middles_;
  CutPosition reach_;
  std::vector<uint32_t>& places_;
  std::vector<uint32_t> spare_;
};

/// Halves all ranges of one depth: large ones by all threads one after the other, small ones side by side;
/// those not cut stay empty.
std::vector<Halves> halve_all(Halver& halver, const std::vector<Range>& ranges, Executor& executor) {
  constexpr size_t large = 4 * Halver::stretch;
  std::vector<Halves> halves(ranges.size());
  for (size_t i = 0; i < ranges.size(); ++i) {
    if (ranges[i].is_cut() && ranges[i].size() > large) halves[i] = halver.halve(ranges[i], executor);
  }
  executor.parallel_for(ranges.size(), [&](size_t i) {
    if (ranges[i].is_cut() && ranges[i].size() <= large)
      halves[i] = halver.halve(ranges[i], serial_executor());
  });
  return halves;
}

}  // namespace

void Bisection::set_side(size_t side, uint32_t to) {
  if (side != no_side) cuts[side / 2].sides[side % 2] = to;
}

/// The loop ends at a leaf: ~ of a piece is no number of a cut, as long as there are fewer than 2^31 pieces.
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

/// Each level halves the pieces of a range, so that the loop ends after their logarithm.
Bisection bisect(std::span<const Middle> middles, const CutPosition& reach, uint64_t pieces,
                 Executor& executor) {
  Bisection found;
  if (middles.empty()) return found;
  found.places.resize(middles.size());
  std::iota(found.places.begin(), found.places.end(), 0u);
  Halver halver(middles, reach, found.places);
  std::vector<Range> ranges = {{0, middles.size(), pieces}};
  const auto is_cut = [](const Range& range) { return range.is_cut(); };
  // All of one depth at once: they have no cells in common.
  while (std::any_of(ranges.begin(), ranges.end(), is_cut)) {
    const std::vector<Halves> halves = halve_all(halver, ranges, executor);
    const std::vector<Range> whole = std::move(ranges);
    ranges.clear();
    for (size_t i = 0; i < halves.size(); ++i) {
      if (!whole[i].is_cut()) {
        ranges.push_back(whole[i]);
        continue;
      }
      found.set_side(whole[i].side, static_cast<uint32_t>(found.cuts.size()));
      for (size_t side = 0; side < 2; ++side) {
        Range& range = ranges.emplace_back(halves[i].ranges[side]);
        range.side = 2 * found.cuts.size() + side;
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
