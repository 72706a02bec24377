#pragma once

#include "volume/order/cell_order.h"

namespace maille {

/// The order in which cells come at gates (gates.h), and what the coder is told of each.
struct GateOrder {
  std::vector<std::vector<uint64_t>> cells;  ///< by block, as CellOrders
  std::vector<uint8_t> borders;  ///< by cell in this order: a bit for each face that no later one meets
};

/// For meshes whose cells all have shapes. Cells of each block go from gate to gate, so that none must tell
/// where it is; blocks without polygons and solids come in the order of the front.
GateOrder gate_order(const Mesh& mesh);

/// Has a block cells with a shape of at least so many dimensions?
bool has_cells_of(const CellBlock& block, unsigned dimension);

}  // namespace maille
