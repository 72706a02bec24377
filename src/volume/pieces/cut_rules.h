#pragma once

#include <maille/executor.h>
#include <maille/mesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "base/bytes.h"

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

/// The middle of a cell's corners, in floats: cuts need no more, and it is what memory is taken by.
struct Middle {
  std::array<float, 3> at;
  uint32_t cell;
};

/// What cuts know of a cell, from its corners; 0 for a cell without any.
class CellCorners {
 public:
  void add(const CutPosition& position) {
    for (unsigned k = 0; k < 3; ++k) {
      sum_[k] += static_cast<double>(position[k]);
      low_[k] = corners_ == 0 ? position[k] : std::min(low_[k], position[k]);
      high_[k] = corners_ == 0 ? position[k] : std::max(high_[k], position[k]);
    }
    ++corners_;
  }
  /// Summed in doubles in the order of the corners.
  CutPosition middle() const {
    const double share = corners_ == 0 ? 0 : 1 / static_cast<double>(corners_);
    CutPosition middle;
    for (unsigned k = 0; k < 3; ++k) middle[k] = static_cast<float>(sum_[k] * share);
    return middle;
  }
  /// How far it reaches along each axis.
  CutPosition reach() const { return {high_[0] - low_[0], high_[1] - low_[1], high_[2] - low_[2]}; }

 private:
  std::array<double, 3> sum_{};
  CutPosition low_{}, high_{};
  size_t corners_ = 0;
};

/// How far the cells of a mesh reach along each axis, counted in steps of about a quarter of an octave.
/// Counts are the same in any order, whichever thread or rank has a cell; sums of floats would not be.
class ReachCounts {
 public:
  void add(const CutPosition& reach) {
    for (unsigned k = 0; k < 3; ++k) ++counts_[k * steps + (bits_as<uint32_t>(reach[k]) >> step_bits)];
  }
  void add(const ReachCounts& other) {
    for (size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
  }
  /// For sums over ranks.
  std::span<uint64_t> counts() { return counts_; }
  /// That of the cell in the middle, for each axis, rounded down to a step.
  CutPosition median() const;

 private:
  // A float that is not negative has its exponent and two bits of its mantissa above these: 2^(31 - 21)
  // steps.
  static constexpr unsigned step_bits = 21, steps = 1024;
  std::vector<uint64_t> counts_ = std::vector<uint64_t>(size_t{3} * steps);
};

/// How many pieces so many cells become: the nearest number to cells / target, at least one, and no more than
/// there are cells.
inline uint64_t pieces_of(uint64_t cells, uint64_t target) {
  const uint64_t wanted = std::max<uint64_t>(1, cells / target + (cells % target >= target - target / 2));
  return std::min(wanted, std::max<uint64_t>(1, cells));
}

/// Axes that a cut may run across, the longest side of the box around the middles first; of equal ones the
/// first. Sides of less than half its length are left out, so that pieces do not become slices: queries would
/// meet more of them, and borders would be hardly fewer (a quarter of a percent over nine meshes).
struct AxesToTry {
  std::array<unsigned, 3> axes{0, 1, 2};
  unsigned count = 3;

  AxesToTry(const CutPosition& low, const CutPosition& high) {
    const auto length = [&](unsigned axis) { return high[axis] - low[axis]; };
    std::stable_sort(axes.begin(), axes.end(), [&](unsigned a, unsigned b) { return length(a) > length(b); });
    while (length(axes[count - 1]) < length(axes[0]) / 2) --count;
  }
  const unsigned* begin() const { return axes.data(); }
  const unsigned* end() const { return axes.data() + count; }
};

/// Where cells, sorted along the axis, are cut: before cell `at`, or at a better place before one of the
/// cells behind `first` and before `last`.
struct CutPlace {
  uint64_t first = 0, at = 0, last = 0;
  uint64_t window = 1;  ///< cells on either side of a place by which it is judged
};

/// Where at least two cells that become at least two pieces are cut: about at the share of the lower half of
/// the pieces. Both sides keep at least one cell.
///
/// A cut moves by a quarter of a piece, or by a layer of a cube of so many cells where that is more, so that
/// it finds the end of one; never by more than an eighth of all. With a sixteenth of a piece borders had 12 %
/// more points, with a third as many (nine unstructured meshes in 3, 4 and 13 pieces). The window is a
/// quarter of a layer: with half a layer or more 1 % more. Pieces of fewer than 16 cells do not move theirs.
inline CutPlace cut_place(uint64_t cells, uint64_t pieces) {
  CutPlace place;
  place.at = cells / pieces * (pieces / 2) + cells % pieces * (pieces / 2) / pieces;
  uint64_t side = 1;
  while (side * side * side < cells) ++side;
  const uint64_t layer = side * side;
  const uint64_t slack =
      cells / pieces < 16 ? 0 : std::min(cells / 8, std::max<uint64_t>(cells / pieces / 4, layer));
  place.first = place.at - std::min(slack, place.at - 1);
  place.last = std::min(place.at + slack + 1, cells);
  place.window = std::max<uint64_t>(1, std::min(slack / 2, layer / 4));
  return place;
}

/// The place near `at` where the fewest cells are on the way: where as many as the window has lie farthest
/// apart, and there where the gap between two is widest; of equal ones the nearest. A lattice has wide gaps
/// between its layers and none within, so that cuts follow layers. `coordinate(i)`: of cell i along the axis,
/// from place.first to place.last, where they are sorted.
template <class Coordinate>
uint64_t sparsest_place(const CutPlace& place, Coordinate coordinate) {
  const auto nearest_best = [](uint64_t first, uint64_t last, uint64_t at, auto value) {
    uint64_t best = at;
    double of_best = value(at);
    const auto distance = [&](uint64_t i) { return i < at ? at - i : i - at; };
    for (uint64_t i = first; i < last; ++i) {
      const double of_this = value(i);
      if (of_this > of_best || (of_this >= of_best && distance(i) < distance(best))) {
        best = i;
        of_best = of_this;
      }
    }
    return best;
  };
  // Windows that would end outside are shorter, and so lose against whole ones.
  const auto length = [&](uint64_t i, uint64_t window) {
    const uint64_t low = i - std::min(window, i - place.first), high = std::min(i + window, place.last) - 1;
    return static_cast<double>(coordinate(high)) - static_cast<double>(coordinate(low));
  };
  const uint64_t sparse = nearest_best(place.first + 1, place.last, place.at,
                                       [&](uint64_t i) { return length(i, place.window); });
  const uint64_t first = std::max(place.first + 1, sparse - std::min(place.window, sparse));
  return nearest_best(first, std::min(sparse + place.window, place.last), sparse,
                      [&](uint64_t i) { return length(i, 1); });
}

/// Whether a cell may be cut by a plane between two places on the axis, judged by its middle and by how far
/// most cells reach. The axis with the fewest of these is the one to cut across. (On nine unstructured meshes
/// borders have 25 % fewer points than with the longest axis and the widest gap near `at`, on lattices 5 to
/// 11 % fewer.)
inline bool is_near(float x, float below, float above, float reach) {
  const double plane = (static_cast<double>(below) + static_cast<double>(above)) / 2;
  return std::abs(static_cast<double>(x) - plane) < static_cast<double>(reach);
}

}  // namespace maille
