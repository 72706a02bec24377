#include "surface/parts/partition.h"

#include <algorithm>
#include <array>
#include <limits>

#include "base/bytes.h"
#include "base/chunks.h"

namespace maille {
namespace {

/// A cell, and the middle of its box, which is the same whatever the order of its nodes; 16 bytes, of which
/// many are moved.
struct PlacedCell {
  std::array<float, 3> place;
  uint32_t cell;
};

struct Range {
  float low = std::numeric_limits<float>::max();
  float high = std::numeric_limits<float>::lowest();
  void add(float at) {
    low = std::min(low, at);
    high = std::max(high, at);
  }
};

/// Halves are added, as the sum of two large floats could overflow. Minimum and maximum do not depend on the
/// order of nodes, sums would.
PlacedCell place_cell(std::span<const float> positions, std::span<const uint32_t> nodes, uint32_t cell) {
  std::array<Range, 3> box;
  for (const uint32_t node : nodes) {
    for (unsigned axis = 0; axis < 3; ++axis) box[axis].add(positions[size_t{3} * node + axis]);
  }
  PlacedCell placed{{}, cell};
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (!nodes.empty()) placed.place[axis] = box[axis].low / 2 + box[axis].high / 2;
  }
  return placed;
}

/// Once, instead of looking at nodes in each round of cuts (ef6ac70).
std::vector<PlacedCell> place_cells(const Mesh& mesh, std::span<const float> positions, Executor& executor) {
  std::vector<PlacedCell> cells(mesh.cell_count());
  uint64_t before = 0;
  for (const CellBlock& block : mesh.blocks) {
    for_each_chunk(executor, block.size(), [&](size_t, size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i)
        cells[before + i] = place_cell(positions, block.cell(i), static_cast<uint32_t>(before + i));
    });
    before += block.size();
  }
  return cells;
}

std::array<unsigned, 3> axes_by_length(std::span<const PlacedCell> cells) {
  std::array<Range, 3> box;
  for (const PlacedCell& cell : cells) {
    for (unsigned axis = 0; axis < 3; ++axis) box[axis].add(cell.place[axis]);
  }
  const auto length = [&](unsigned axis) {
    return static_cast<double>(box[axis].high) - static_cast<double>(box[axis].low);
  };
  std::array<unsigned, 3> axes = {0, 1, 2};
  // Of equal lengths the first axis, whatever the library's sort does.
  std::stable_sort(axes.begin(), axes.end(), [&](unsigned a, unsigned b) { return length(a) > length(b); });
  return axes;
}

/// An integer that rises with a float: the bits, with those of negative ones turned over.
uint32_t rising(float number) {
  const auto bits = load<uint32_t>(&number);
  return (bits >> 31) != 0 ? ~bits : bits | 1u << 31;
}

/// The median of such integers, by their upper half, then by the lower one: a fifth of the time of
/// std::nth_element(), which one thread needs while others wait for the first cut.
template <class Key>
uint32_t median(std::span<const PlacedCell> cells, Key key) {
  size_t rank = cells.size() / 2;
  uint32_t found = 0;
  for (const unsigned shift : {16u, 0u}) {
    std::vector<size_t> count(1 << 16);
    for (const PlacedCell& cell : cells) {
      const uint32_t k = key(cell);
      if (shift == 16 || k >> 16 == found >> 16) ++count[k >> shift & 0xffff];
    }
    uint32_t digit = 0;
    for (; count[digit] <= rank; ++digit) rank -= count[digit];
    found |= digit << shift;
  }
  return found;
}

/// Puts the lower half in front; returns its size, 0 when all cells are in one place. Cells at the median go
/// to one side together, so that the cut depends on the set of cells only.
size_t halve(std::span<PlacedCell> cells, unsigned axis) {
  // Zeros are equal, whatever their sign.
  const auto place = [axis](const PlacedCell& cell) { return rising(cell.place[axis] + 0.0f); };
  const uint32_t at = median(cells, place);
  const auto below =
      std::partition(cells.begin(), cells.end(), [&](const PlacedCell& cell) { return place(cell) < at; });
  if (below != cells.begin()) return static_cast<size_t>(below - cells.begin());
  const auto equal =
      std::partition(cells.begin(), cells.end(), [&](const PlacedCell& cell) { return place(cell) <= at; });
  return equal == cells.end() ? 0 : static_cast<size_t>(equal - cells.begin());
}

/// Where the longest axis cannot be cut, the next one is tried.
size_t halve_longest(std::span<PlacedCell> cells) {
  for (const unsigned axis : axes_by_length(cells)) {
    if (const size_t left = halve(cells, axis)) return left;
  }
  return 0;
}

struct Piece {
  std::span<PlacedCell> cells;
  bool whole;  ///< not to be cut any more
};

/// Each piece cut once, or whole; all of them at once. Still in order.
std::vector<Piece> cut_all(std::span<const Piece> pieces, uint64_t most_cells, Executor& executor) {
  std::vector<size_t> left(pieces.size());
  executor.parallel_for(pieces.size(), [&](size_t i) {
    if (!pieces[i].whole && pieces[i].cells.size() > most_cells) left[i] = halve_longest(pieces[i].cells);
  });
  std::vector<Piece> cut;
  for (size_t i = 0; i < pieces.size(); ++i) {
    const std::span<PlacedCell> cells = pieces[i].cells;
    if (left[i] == 0) {
      cut.push_back({cells, true});
    } else {
      cut.push_back({cells.first(left[i]), false});
      cut.push_back({cells.subspan(left[i]), false});
    }
  }
  return cut;
}

}  // namespace

std::vector<uint32_t> partition_cells(const Mesh& mesh, std::span<const float> positions, uint64_t most_cells,
                                      Executor& executor) {
  std::vector<PlacedCell> cells = place_cells(mesh, positions, executor);
  std::vector<Piece> pieces = {{cells, false}};
  // Each cut leaves cells on both sides, and at most two in a row leave more than half on one: those of one
  // place may be many. So these are at most 64 rounds.
  for (size_t before = 0; before != pieces.size();) {
    before = pieces.size();
    pieces = cut_all(pieces, most_cells, executor);
  }
  std::vector<uint32_t> part_of(cells.size());
  executor.parallel_for(pieces.size(), [&](size_t part) {
    for (const PlacedCell& cell : pieces[part].cells) part_of[cell.cell] = static_cast<uint32_t>(part);
  });
  return part_of;
}

}  // namespace maille
