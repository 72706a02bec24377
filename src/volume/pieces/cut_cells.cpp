#include "volume/pieces/cut_cells.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "numbers/number_map.h"

namespace maille {
namespace {

/// The middle of a cell's corners. Floats: cuts need no more, and memory counts.
struct Middle {
  std::array<float, 3> at;
  uint32_t cell;
};

/// Coordinates that are not finite count as 0.
float coordinate(const Array& positions, uint64_t number) {
  const double x =
      number_as_double(positions.type, positions.bytes.data() + number * size_of(positions.type));
  constexpr double most = 1e37;
  return x > -most && x < most ? static_cast<float>(x) : 0;
}

std::vector<Middle> middles_of(const Mesh& mesh) {
  std::vector<Middle> middles;
  middles.reserve(mesh.cell_count());
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto points = block.cell(i);
      std::array<double, 3> sum{};
      for (const uint32_t point : points) {
        for (unsigned k = 0; k < 3; ++k) sum[k] += coordinate(mesh.points, uint64_t{3} * point + k);
      }
      const double share = points.empty() ? 0 : 1 / static_cast<double>(points.size());
      Middle& middle = middles.emplace_back();
      for (unsigned k = 0; k < 3; ++k) middle.at[k] = static_cast<float>(sum[k] * share);
      middle.cell = static_cast<uint32_t>(middles.size() - 1);
    }
  }
  return middles;
}

/// Cells that become so many pieces.
struct Range {
  size_t begin = 0, end = 0;
  uint64_t pieces = 1;
};

unsigned longest_axis(const Middle* begin, const Middle* end) {
  std::array<float, 3> low = begin->at, high = begin->at;
  for (const Middle* middle = begin; middle != end; ++middle) {
    for (unsigned k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], middle->at[k]);
      high[k] = std::max(high[k], middle->at[k]);
    }
  }
  unsigned axis = 0;
  for (unsigned k = 1; k < 3; ++k) {
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  }
  return axis;
}

/// The place between two middles where the gap is widest, of those near `at`; of equal ones the nearest. All
/// from `first` to `last` are sorted.
size_t widest_gap(const std::vector<Middle>& middles, size_t first, size_t last, size_t at, unsigned axis) {
  size_t best = at;
  const auto gap = [&](size_t i) { return middles[i].at[axis] - middles[i - 1].at[axis]; };
  const auto distance = [&](size_t i) { return i < at ? at - i : i - at; };
  for (size_t i = first + 1; i < last; ++i) {
    if (gap(i) > gap(best) || (gap(i) >= gap(best) && distance(i) < distance(best))) best = i;
  }
  return best;
}

/// How many cells a cut may move: a layer of a cube of so many, so that it finds the end of one; pieces stay
/// within an eighth of their size as far as that allows.
size_t slack_of(size_t cells, uint64_t pieces) {
  if (cells / pieces < 16) return 0;
  size_t side = 1;
  while (side * side * side < cells) ++side;
  return std::min(cells / 16, std::max<size_t>(cells / pieces / 16, side * side));
}

/// Puts the cells below the cut before the others; returns where it is.
size_t bisect(std::vector<Middle>& middles, const Range& range) {
  Middle* const begin = middles.data() + range.begin;
  Middle* const end = middles.data() + range.end;
  const unsigned axis = longest_axis(begin, end);
  const auto before = [axis](const Middle& a, const Middle& b) {
    return std::tie(a.at[axis], a.cell) < std::tie(b.at[axis], b.cell);
  };
  const size_t size = range.end - range.begin;
  const size_t at =
      range.begin + static_cast<size_t>(size / range.pieces * (range.pieces / 2) +
                                        size % range.pieces * (range.pieces / 2) / range.pieces);
  const size_t slack = slack_of(size, range.pieces);
  const size_t first = at - std::min(slack, at - range.begin - 1);
  const size_t last = std::min(at + slack + 1, range.end);
  std::nth_element(begin, middles.data() + first, end, before);
  std::nth_element(middles.data() + first, middles.data() + last - 1, end, before);
  std::sort(middles.data() + first, middles.data() + last, before);
  return widest_gap(middles, first, last, at, axis);
}

}  // namespace

std::vector<std::vector<uint32_t>> cut_cells(const Mesh& mesh, uint64_t target, Executor& executor) {
  std::vector<Middle> middles = middles_of(mesh);
  const uint64_t wanted = std::max<uint64_t>(1, (middles.size() + target / 2) / target);
  std::vector<Range> ranges = {
      {0, middles.size(), std::min<uint64_t>(wanted, std::max<size_t>(1, middles.size()))}};
  // All of one depth at once: they have no cells in common.
  for (bool more = true; more;) {
    std::vector<std::array<Range, 2>> halves(ranges.size());
    executor.parallel_for(ranges.size(), [&](size_t i) {
      const Range& range = ranges[i];
      if (range.pieces < 2 || range.end - range.begin < 2) {
        halves[i][0] = {range.begin, range.end, 1};
        return;
      }
      const size_t at = bisect(middles, range);
      halves[i] = {Range{range.begin, at, range.pieces / 2},
                   Range{at, range.end, range.pieces - range.pieces / 2}};
    });
    ranges.clear();
    more = false;
    for (const auto& half : halves) {
      for (const Range& range : half) {
        if (range.end > range.begin) ranges.push_back(range);
        more = more || (range.pieces > 1 && range.end - range.begin > 1);
      }
    }
  }
  std::vector<std::vector<uint32_t>> pieces(ranges.size());
  executor.parallel_for(ranges.size(), [&](size_t i) {
    for (size_t k = ranges[i].begin; k < ranges[i].end; ++k) pieces[i].push_back(middles[k].cell);
    std::sort(pieces[i].begin(), pieces[i].end());
  });
  return pieces;
}

}  // namespace maille
