#include "volume/order/gate_order.h"

namespace maille {
namespace {

/// A face of a cell and one of its corners.
struct FaceCorner {
  unsigned face, corner;
};

// A bit for each.
unsigned corners_of(const CellFace& face) {
  unsigned corners = 0;
  for (unsigned i = 0; i < face.size; ++i) corners |= 1u << face.corner[i];
  return corners;
}

/// The turn by which a cell comes best. Hexahedra go on with the axes of the one at whose gate they come,
/// which positions are predicted by (canewt takes 4 % more otherwise). Others come by the lowest face that a
/// turn allows, with the corner that was told; of equals the first turn.
uint8_t best_turn(unsigned kind, FaceCorner own, unsigned gate_kind, FaceCorner gate) {
  const CellShape& shape = cell_shapes[kind];
  const auto turns = turns_of(shape.type);
  unsigned best = 0, lowest = ~0u;
  const bool axes = kind == hexahedron_kind && gate_kind == hexahedron_kind;
  const unsigned there = axes ? shape.neighbours[gate.corner] & ~corners_of(shape.face[gate.face]) : 0;
  for (unsigned i = 0; i < turns.size(); ++i) {
    unsigned f = 0, k = 0;
    while (turns[i].face[f] != own.face) ++f;
    const CellFace& face = shape.face[f];
    while (k < face.size && turns[i].corner[face.corner[k]] != own.corner) ++k;
    // f ^ 1 is the opposite face (cell_shape.cpp), and the corner must be the one across the gate's.
    const bool goes_on = axes && f == (gate.face ^ 1u) && 1u << face.corner[k] == there;
    const unsigned rank = goes_on ? 0 : 1 + 4 * f + k;
    if (rank < lowest) lowest = rank, best = i;
  }
  return static_cast<uint8_t>(best);
}

/// The gates of one block as the coder has them: each cell adds its faces behind those that wait, in the
/// order of faces as it is turned.
class GatesOfBlock {
 public:
  /// `turns`: of each cell, to be found; or none.
  GatesOfBlock(const CellBlock& block, GateOrder& found, std::vector<uint64_t>& order,
               std::vector<uint8_t>& turns)
      : block_(block),
        neighbours_(neighbours_of(block)),
        is_out_(block.size()),
        found_(found),
        order_(order),
        turns_(turns) {
    waiting_.reserve(block.size());
  }
  /// A gate whose cell has come meanwhile is passed over, as it is closed then.
  void go_through() {
    size_t first = 0;
    for (uint32_t start = 0; start < block_.size(); ++start) {
      if (is_out_[start] != 0) continue;
      take(start);
      for (; first < waiting_.size(); ++first) {
        const Gate gate = waiting_[first];
        const uint32_t cell = neighbours_[gate.cell][gate.face];
        if (is_out_[cell] != 0) continue;
        if (!turns_.empty()) turns_[cell] = turn_at(gate, cell);
        take(cell);
      }
    }
  }

 private:
  /// A face of a cell, as it is in the block.
  struct Gate {
    uint32_t cell, face;
  };
  unsigned kind_at(uint32_t cell) const { return kind_of(block_.type_of(cell)); }
  const CellTurn* turn_of(uint32_t cell) const {
    return turns_.empty() || turns_[cell] == 0 ? nullptr : &turns_of(block_.type_of(cell))[turns_[cell]];
  }

  // The cell comes: which of its faces are borders is noted in the order in which the coder has its faces,
  // and the others wait behind all gates so far.
  void take(uint32_t cell) {
    is_out_[cell] = 1;
    order_.push_back(cell);
    unsigned border = 0;
    const CellTurn* const turn = turn_of(cell);
    for (unsigned f = 0; f < most_faces; ++f) {
      const unsigned face = turn != nullptr ? turn->face[f] : f;
      const uint32_t across = neighbours_[cell][face];
      if (across == no_cell) border |= 1u << f;
      if (across != no_cell && is_out_[across] == 0) waiting_.push_back({cell, face});
    }
    found_.borders.push_back(static_cast<uint8_t>(border));
  }

  /// How the cell at a gate is turned: the first corner of the gate, as that cell is turned, comes first.
  uint8_t turn_at(Gate gate, uint32_t cell) const {
    const unsigned there = kind_at(gate.cell), kind = kind_at(cell);
    const CellTurn* const turn = turn_of(gate.cell);
    unsigned f = gate.face;
    if (turn != nullptr) {
      for (f = 0; turn->face[f] != gate.face;) ++f;
    }
    const uint8_t corner = cell_shapes[there].face[f].corner[0];
    const uint32_t first = block_.cell(gate.cell)[turn != nullptr ? turn->corner[corner] : corner];
    const CellShape& shape = cell_shapes[kind];
    const auto points = block_.cell(cell);
    for (unsigned own = 0; own < shape.faces; ++own) {
      if (neighbours_[cell][own] != gate.cell) continue;
      for (unsigned i = 0; i < shape.face[own].size; ++i) {
        const unsigned c = shape.face[own].corner[i];
        if (points[c] == first) return best_turn(kind, {own, c}, there, {f, corner});
      }
    }
    return 0;
  }

  const CellBlock& block_;
  const Neighbours neighbours_;
  std::vector<uint8_t> is_out_;
  std::vector<Gate> waiting_;
  GateOrder& found_;
  std::vector<uint64_t>& order_;
  std::vector<uint8_t>& turns_;
};

}  // namespace

bool has_cells_of(const CellBlock& block, unsigned dimension) {
  for (uint64_t i = 0; i < block.size(); ++i) {
    const unsigned kind = kind_of(block.type_of(i));
    if (kind < shape_count && cell_shapes[kind].dimension >= dimension) return true;
    if (block.type != CellType::mixed) return false;
  }
  return false;
}

GateOrder gate_order(const Mesh& mesh, bool turned) {
  GateOrder found;
  for (const CellBlock& block : mesh.blocks) {
    std::vector<uint64_t> order;
    std::vector<uint8_t> turns;
    // Lines and vertices have no gates, and cells are numbered by 32 bits here.
    if (block.size() < no_cell && has_cells_of(block, 2)) {
      order.reserve(block.size());
      if (turned) turns.resize(block.size());
      GatesOfBlock(block, found, order, turns).go_through();
    } else {
      order = front_order(block);
      found.borders.resize(found.borders.size() + block.size());
    }
    found.cells.push_back(std::move(order));
    found.turns.push_back(std::move(turns));
  }
  return found;
}

}  // namespace maille
