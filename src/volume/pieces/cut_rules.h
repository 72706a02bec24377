#pragma once

#include <maille/executor.h>
#include <maille/mesh.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace maille {

// The rules by which cells are cut into pieces: where they are in one memory (cut_cells.cpp), in a file read
// in parts (source_pieces.cpp), and where each rank has some (volume/ranks). All find the same cuts, so that
// a file does not depend on how it was made.

/// Coordinates as cuts take them: floats, 0 for those that are not finite. Cuts need no more, and memory
/// counts.
using CutPosition = std::array<float, 3>;
/// `position`: three numbers of the type.
CutPosition cut_position(Scalar type, const std::byte* position);
/// Of all points.
std::vector<CutPosition> cut_positions(const Array& positions, Executor& executor);

/// The middle of a cell's corners, summed in doubles in the order of the corners; 0 for a cell without any.
class MiddleSum {
 public:
  void add(const CutPosition& position) {
    for (unsigned k = 0; k < 3; ++k) sum_[k] += static_cast<double>(position[k]);
    ++points_;
  }
  CutPosition middle() const {
    const double share = points_ == 0 ? 0 : 1 / static_cast<double>(points_);
    CutPosition middle;
    for (unsigned k = 0; k < 3; ++k) middle[k] = static_cast<float>(sum_[k] * share);
    return middle;
  }

 private:
  std::array<double, 3> sum_{};
  size_t points_ = 0;
};

/// How many pieces so many cells become: the nearest number to cells / target, at least one, and no more than
/// there are cells.
inline uint64_t pieces_of(uint64_t cells, uint64_t target) {
  const uint64_t wanted = std::max<uint64_t>(1, cells / target + (cells % target >= target - target / 2));
  return std::min(wanted, std::max<uint64_t>(1, cells));
}

/// Cuts run across the longest side of the box around the middles; of equal ones the first.
inline unsigned longest_axis(const std::array<float, 3>& low, const std::array<float, 3>& high) {
  unsigned axis = 0;
  for (unsigned k = 1; k < 3; ++k) {
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  }
  return axis;
}

/// Where cells, sorted along the axis, are cut: before cell `at`, or at a better place before one of the
/// cells behind `first` and before `last`.
struct CutPlace {
  uint64_t first = 0, at = 0, last = 0;
};

/// How many cells a cut may move: a layer of a cube of so many, so that it finds the end of one; pieces stay
/// within an eighth of their size as far as that allows. Pieces of fewer than 16 cells do not move theirs.
inline uint64_t slack_of(uint64_t cells, uint64_t pieces) {
  if (cells / pieces < 16) return 0;
  uint64_t side = 1;
  while (side * side * side < cells) ++side;
  return std::min(cells / 16, std::max<uint64_t>(cells / pieces / 16, side * side));
}

/// Where at least two cells that become at least two pieces are cut: at the share of the lower half of the
/// pieces. Both sides keep at least one cell.
inline CutPlace cut_place(uint64_t cells, uint64_t pieces) {
  CutPlace place;
  place.at = cells / pieces * (pieces / 2) + cells % pieces * (pieces / 2) / pieces;
  const uint64_t slack = slack_of(cells, pieces);
  place.first = place.at - std::min(slack, place.at - 1);
  place.last = std::min(place.at + slack + 1, cells);
  return place;
}

/// The place between two middles where the gap is widest, of those near `at`; of equal ones the nearest.
/// `coordinate(i)`: of cell i along the axis, from place.first to place.last, where they are sorted. A
/// lattice has wide gaps between its layers and none within, so that cuts follow layers.
template <class Coordinate>
uint64_t widest_gap(const CutPlace& place, Coordinate coordinate) {
  uint64_t best = place.at;
  const auto gap = [&](uint64_t i) { return coordinate(i) - coordinate(i - 1); };
  const auto distance = [&](uint64_t i) { return i < place.at ? place.at - i : i - place.at; };
  for (uint64_t i = place.first + 1; i < place.last; ++i) {
    if (gap(i) > gap(best) || (gap(i) >= gap(best) && distance(i) < distance(best))) best = i;
  }
  return best;
}

}  // namespace maille
