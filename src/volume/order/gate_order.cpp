#include "volume/order/gate_order.h"

namespace maille {
namespace {

/// The gates of one block as the coder has them: each cell adds its faces behind those that wait.
void go_through_gates(const CellBlock& block, const Neighbours& neighbours, std::vector<uint64_t>& order,
                      std::vector<uint8_t>& borders) {
  std::vector<uint8_t> is_out(block.size());
  std::vector<uint32_t> waiting;  // the cells at the gates
  waiting.reserve(block.size());
  size_t first = 0;
  const auto take = [&](uint32_t cell) {
    is_out[cell] = 1;
    order.push_back(cell);
    unsigned border = 0;
    for (unsigned f = 0; f < most_faces; ++f) {
      const uint32_t across = neighbours[cell][f];
      if (across == no_cell) border |= 1u << f;
      if (across != no_cell && is_out[across] == 0) waiting.push_back(across);
    }
    borders.push_back(static_cast<uint8_t>(border));
  };
  for (uint32_t start = 0; start < block.size(); ++start) {
    if (is_out[start] != 0) continue;
    take(start);
    for (; first < waiting.size(); ++first) {
      if (is_out[waiting[first]] == 0) take(waiting[first]);
    }
  }
}

}  // namespace

bool has_cells_of(const CellBlock& block, unsigned dimension) {
  for (uint64_t i = 0; i < block.size(); ++i) {
    const unsigned kind = kind_of(block.type_of(i));
    if (kind < shape_count && cell_shapes[kind].dimension >= dimension) return true;
    if (block.type != CellType::mixed) return false;
  }
  return false;
}

GateOrder gate_order(const Mesh& mesh) {
  GateOrder found;
  for (const CellBlock& block : mesh.blocks) {
    std::vector<uint64_t> order;
    if (block.size() < no_cell && has_cells_of(block, 2)) {
      order.reserve(block.size());
      go_through_gates(block, neighbours_of(block), order, found.borders);
    } else {
      order = front_order(block);
      found.borders.resize(found.borders.size() + block.size());
    }
    found.cells.push_back(std::move(order));
  }
  return found;
}

}  // namespace maille
