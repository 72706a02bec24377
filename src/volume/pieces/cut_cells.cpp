#include "volume/pieces/cut_cells.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "volume/pieces/cut_rules.h"

namespace maille {
namespace {

/// The middle of a cell's corners. Floats: cuts need no more, and memory counts.
struct Middle {
  std::array<float, 3> at;
  uint32_t cell;
};

std::vector<Middle> middles_of(const Mesh& mesh) {
  std::vector<Middle> middles;
  middles.reserve(mesh.cell_count());
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto cell = static_cast<uint32_t>(middles.size());
      middles.push_back({middle_of(mesh.points, block.cell(i)), cell});
    }
  }
  return middles;
}

/// Cells that become so many pieces.
struct Range {
  size_t begin = 0, end = 0;
  uint64_t pieces = 1;
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

/// Puts the cells below the cut before the others; returns where it is.
size_t bisect(std::vector<Middle>& middles, const Range& range) {
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
  return range.begin + widest_gap(place, [&](size_t i) { return begin[i].at[axis]; });
}

}  // namespace

std::vector<std::vector<uint32_t>> cut_cells(const Mesh& mesh, uint64_t target, Executor& executor) {
  std::vector<Middle> middles = middles_of(mesh);
  std::vector<Range> ranges = {{0, middles.size(), pieces_of(middles.size(), target)}};
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
