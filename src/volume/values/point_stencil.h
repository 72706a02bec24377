#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "volume/cells/cell_coder.h"

namespace maille {

/// A weighted sum of values of points in memory. Eight suffice: two parallelograms have six, nodes in the
/// middle of a hexahedron eight.
struct PointSum {
  std::array<uint32_t, 8> slot;  ///< `count` of them
  std::array<double, 8> weight;
  unsigned count = 0;

  void add(uint32_t from, double by) {
    slot[count] = from;
    weight[count++] = by;
  }
};

/// What a new point may be expected to be, from the known points of its cell and those behind them. It is
/// large, and only what the counts tell is filled in: one is used again and again. It holds slots, not
/// values, so that one stencil serves all arrays on points.
struct PointStencil {
  /// full: all other corners of a hexahedron are known. Situations stand in the format, as models are kept
  /// for each (docs/format.md, 16.7).
  enum Situation : uint8_t { full = 0, partial = 8, between = 24, alone = 31, situations = 32 };
  uint8_t situation = alone;  ///< full + corner; partial + 4 * parallelograms + neighbours; between + ...
  unsigned sums = 0;
  std::array<PointSum, 3> sum;
  unsigned near_count = 0;
  std::array<uint32_t, 3> near;  ///< neighbours along edges, whose residuals tell how large this one will be
  /// The other seven corners, in an order that depends on the corner only: neighbours, then those across
  /// faces, then the one across the cell. Only if full.
  std::array<uint32_t, 7> others;

  /// By component what the number would be on a plane through those around (PlaneFit); null: not known.
  const double* plane = nullptr;
  /// By component its place in the step before; null: not known.
  const double* before = nullptr;

  bool is_full() const { return situation < partial; }
  void clear() {
    situation = alone;
    sums = near_count = 0;
    plane = before = nullptr;
  }
  PointSum& add_sum() {
    sum[sums].count = 0;
    return sum[sums++];
  }
};

/// By corner of a hexahedron the seven others, in the order of PointStencil::others.
extern const std::array<std::array<uint8_t, 7>, most_corners> others_of_corner;

/// Whether all other corners of the point's cell, a hexahedron (by whatever type), are there before it: the
/// point is the only new corner, or the last of several.
inline bool is_full(const NewPoint& point, const CodedCells& cells) {
  return point.cell != no_slot && point.fresh >> point.node == 1 && cells.kinds[point.cell] < shape_count &&
         cell_shapes[cells.kinds[point.cell]].corners == 8;
}

/// Fills in the stencil of a point that came up with a cell of the block, or clears it for a point without
/// one.
void find_stencil(const NewPoint& point, const CodedCells& cells, PointStencil& stencil);

}  // namespace maille
