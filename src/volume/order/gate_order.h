#pragma once

#include <span>

#include "mesh/cell_turns.h"
#include "volume/order/cell_order.h"

namespace maille {

/// By block and cell, which of turns_of() its type; blocks and lists that are empty have none turned.
using CellTurns = std::vector<std::vector<uint8_t>>;

/// The points of a cell, turned if it is; then in `room`, which the result refers to.
inline std::span<const uint32_t> turned_points(const CellBlock& block, uint64_t cell,
                                               std::span<const uint8_t> turns,
                                               std::array<uint32_t, most_corners>& room) {
  const auto points = block.cell(cell);
  if (turns.empty() || turns[cell] == 0) return points;
  const CellTurn& turn = turns_of(block.type_of(cell))[turns[cell]];
  for (size_t k = 0; k < points.size(); ++k) room[k] = points[turn.corner[k]];
  return std::span(room).first(points.size());
}

/// The order in which cells come at gates (gates.h), and what the coder is told of each.
struct GateOrder {
  std::vector<std::vector<uint64_t>> cells;  ///< by block, as CellOrders
  std::vector<uint8_t> borders;  ///< by cell in this order: a bit for each face that no later one meets
  CellTurns turns;
};

/// The order at gates, for meshes whose cells all have shapes. Cells of each block go from gate to gate, so
/// that none must tell where it is; blocks without polygons and solids come in the order of the front.
/// `turned`: cells are turned so that they come to their gates alike. Gates instead of the front take
/// connectivity of tetrahedra from 5.5 to 7.7 down to 4.1 to 6.5 bits (docs/history.md).
/// It must keep the gates exactly as Gates does when the cells are coded: another order would still be coded
/// right, but each cell at another than the first gate costs several decisions more.
GateOrder gate_order(const Mesh& mesh, bool turned);

/// Whether a block has cells with a shape of at least so many dimensions.
bool has_cells_of(const CellBlock& block, unsigned dimension);

}  // namespace maille
