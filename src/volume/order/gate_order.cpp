#include "volume/order/gate_order.h"

#include <algorithm>
#include <utility>

namespace maille {
namespace {

constexpr unsigned most_waiting = 1024;

/// The cell across each face, as neighbours_of() has it, but that of three cells with one face the third has
/// none: faces wait at their lowest point for the same one, a few at a time. Where more do, only the newest
/// are looked at: thousands of cells at one point must not take thousands of times as long.
Neighbours match_faces(const CellBlock& block, uint64_t points) {
  struct Waiting {
    std::array<uint32_t, 4> point;
    uint32_t cell, face, next;
  };
  std::array<uint32_t, most_faces> none;
  none.fill(no_cell);
  Neighbours neighbours(block.size(), none);
  std::vector<uint32_t> first(points, no_cell);
  std::vector<Waiting> waiting;
  uint32_t unused = no_cell;
  for (uint32_t cell = 0; cell < block.size(); ++cell) {
    const unsigned kind = kind_of(block.type_of(cell));
    if (kind >= shape_count) continue;
    const CellShape& shape = cell_shapes[kind];
    const auto nodes = block.cell(cell);
    for (uint32_t f = 0; f < shape.faces; ++f) {
      const CellFace& face = shape.face[f];
      std::array<uint32_t, 4> point;
      point.fill(no_cell);
      for (unsigned i = 0; i < face.size; ++i) point[i] = nodes[shape.place[face.corner[i]]];
      for (const auto& [i, j] : {std::pair(0u, 1u), {2u, 3u}, {0u, 2u}, {1u, 3u}, {1u, 2u}}) {
        const uint32_t low = std::min(point[i], point[j]), high = std::max(point[i], point[j]);
        point[i] = low, point[j] = high;
      }
      uint32_t* at = &first[point[0]];
      unsigned left = most_waiting;
      while (*at != no_cell && left != 0 && waiting[*at].point != point) at = &waiting[*at].next, --left;
      if (*at == no_cell || left == 0) {
        const Waiting entry = {point, cell, f, first[point[0]]};
        if (unused == no_cell) {
          first[point[0]] = static_cast<uint32_t>(waiting.size());
          waiting.push_back(entry);
        } else {
          first[point[0]] = unused;
          unused = std::exchange(waiting[unused], entry).next;
        }
        continue;
      }
      const uint32_t same = *at;
      Waiting& other = waiting[same];
      *at = std::exchange(other.next, unused);
      unused = same;
      if (other.cell == cell) continue;
      neighbours[cell][f] = other.cell;
      neighbours[other.cell][other.face] = cell;
    }
  }
  return neighbours;
}

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
      go_through_gates(block, match_faces(block, mesh.point_count()), order, found.borders);
    } else {
      order = front_order(block);
      found.borders.resize(found.borders.size() + block.size());
    }
    found.cells.push_back(std::move(order));
  }
  return found;
}

}  // namespace maille
