#include "generate/transfinite_order.h"

#include <algorithm>
#include <utility>

namespace maille {

namespace {

constexpr uint32_t per_block = BlockTopology::nodes_per_block;
// Nodes of a block count in threes: place along x + 3 y + 9 z.
constexpr uint32_t weight[3] = {1, 3, 9};

uint32_t place(uint32_t node, unsigned axis) {
  return node / weight[axis] % 3;
}

}  // namespace

SweepOrder::SweepOrder(const BlockTopology& topology, SweepPlan plan)
    : topology_(topology), plan_(std::move(plan)), of_block_(topology.divisions.size()) {
  for (uint32_t s = 0; s < plan_.sweeps.size(); ++s) {
    const auto& blocks = plan_.sweeps[s].blocks;
    for (uint32_t i = 0; i < blocks.size(); ++i) {
      BlockOrder& b = of_block_[blocks[i].block];
      b.swept = &blocks[i];
      for (unsigned a = 0; a < 3; ++a)
        b.divisions[a] = topology.divisions[blocks[i].block][blocks[i].axis[a]];
      b.sweep = s;
      b.position = i;
    }
  }
  choose_owners();
  number();
}

uint32_t SweepOrder::node(uint32_t block, const Place& classes) const {
  const SweepPlan::Block& swept = *of_block_[block].swept;
  const uint32_t layer = swept.backwards ? 2 - classes[2] : classes[2];
  return block * per_block + weight[swept.axis[0]] * classes[0] + weight[swept.axis[1]] * classes[1] +
         weight[swept.axis[2]] * layer;
}

// The key by which the earliest node of an entity is found: sweep, whether it is one point only, step, block
// in the sweep, layer and row, place in it.
std::array<uint32_t, 6> SweepOrder::turn_of(uint32_t node) const {
  const BlockOrder& b = of_block_[node / per_block];
  const BlockTopology::Node& map = topology_.nodes[node];
  Place classes{};
  uint32_t dropped = 0;
  for (unsigned a = 0; a < 3; ++a) {
    classes[a] = place(node % per_block, b.swept->axis[a]);
    if (classes[a] == 1 && map.parameter[b.swept->axis[a]] < 0) dropped = 1;
  }
  if (b.swept->backwards) classes[2] = 2 - classes[2];
  const bool first = classes[2] < 2 || b.divisions[2] == 1;
  // Nodes that share a parameter along the layers come by in the same steps (SweepPlan).
  const uint32_t step = first ? 0 : b.divisions[2] - 1;
  // Of a node whose points are one, a neighbour has the first.
  return {b.sweep, dropped, step, b.position, 3 * classes[2] + classes[1], classes[0]};
}

void SweepOrder::choose_owners() {
  owners_.reserve(topology_.entities.size());
  for (const auto& nodes : topology_.entities) {
    // The node's number decides at last, so there is always one owner, the same everywhere.
    const uint32_t owner = *std::min_element(nodes.begin(), nodes.end(), [&](uint32_t x, uint32_t y) {
      return std::pair(turn_of(x), x) < std::pair(turn_of(y), y);
    });
    owners_.push_back(owner);
    BlockOrder& b = of_block_[owner / per_block];
    Place classes{};
    for (unsigned a = 0; a < 3; ++a) classes[a] = place(owner % per_block, b.swept->axis[a]);
    if (b.swept->backwards) classes[2] = 2 - classes[2];
    b.owned |= uint32_t{1} << (classes[0] + 3 * classes[1] + 9 * classes[2]);
  }
}

uint64_t SweepOrder::row_points(const BlockOrder& b, uint32_t row_class, uint32_t layer_class) {
  return (owned(b, {0, row_class, layer_class}) ? 1u : 0u) +
         (owned(b, {2, row_class, layer_class}) ? 1u : 0u) +
         (owned(b, {1, row_class, layer_class}) ? b.divisions[0] - 1 : 0);
}

uint64_t SweepOrder::layer_points(const BlockOrder& b, uint32_t layer_class) {
  return row_points(b, 0, layer_class) + (b.divisions[1] - 1) * row_points(b, 1, layer_class) +
         row_points(b, 2, layer_class);
}

uint64_t SweepOrder::step_points(const BlockOrder& b, unsigned phase) {
  if (phase == 0) return layer_points(b, 0) + layer_points(b, b.divisions[2] == 1 ? 2 : 1);
  return layer_points(b, phase);
}

// Points and cells are counted, not stored: a number follows from the sums before its sweep, step, block,
// layer and row. So meshes of any size take memory for their blocks only.
void SweepOrder::number() {
  for (const SweepPlan::Sweep& sweep : plan_.sweeps) {
    SweepNumbers numbers;
    numbers.first_point = points_;
    numbers.first_cell = cells_;
    for (const SweepPlan::Block& swept : sweep.blocks) {
      BlockOrder& b = of_block_[swept.block];
      b.points_before = numbers.points;
      b.first_layer_points = layer_points(b, 0);
      b.cells_before = numbers.cells_of_layer;
      for (unsigned phase = 0; phase < 3; ++phase) numbers.points[phase] += step_points(b, phase);
      numbers.cells_of_layer += uint64_t{b.divisions[0]} * b.divisions[1];
    }
    const uint64_t between = sweep.layers < 2 ? 0 : sweep.layers - 2;
    points_ += numbers.points[0] + between * numbers.points[1] + (sweep.layers > 1 ? numbers.points[2] : 0);
    cells_ += sweep.layers * numbers.cells_of_layer;
    of_sweep_.push_back(numbers);
  }
}

uint64_t SweepOrder::owned_number(uint32_t block, const Place& at) const {
  const BlockOrder& b = of_block_[block];
  const SweepNumbers& sweep = of_sweep_[b.sweep];
  const uint32_t step = at[2] == 0 ? 0 : at[2] - 1;
  const unsigned phase = phase_of(step, b.divisions[2]);
  uint64_t number = sweep.first_point + b.points_before[phase];
  if (step > 0) number += sweep.points[0] + (step - 1) * sweep.points[1];
  if (at[2] == 1) number += b.first_layer_points;
  const uint32_t layer = class_of(at[2], b.divisions[2]);
  if (at[1] > 0) number += row_points(b, 0, layer) + (at[1] - 1) * row_points(b, 1, layer);
  const uint32_t row = class_of(at[1], b.divisions[1]);
  if (at[0] > 0) number += (owned(b, {0, row, layer}) ? 1 : 0);
  if (at[0] > 1 && owned(b, {1, row, layer})) number += at[0] - 1;
  return number;
}

uint64_t SweepOrder::cell(uint32_t block, const Place& at) const {
  const BlockOrder& b = of_block_[block];
  const SweepNumbers& sweep = of_sweep_[b.sweep];
  return sweep.first_cell + at[2] * sweep.cells_of_layer + b.cells_before + uint64_t{at[1]} * b.divisions[0] +
         at[0];
}

SweepOrder::Place SweepOrder::moved(const BlockOrder& of, const BlockTopology::Node& from, const Place& at,
                                    uint32_t node, bool last) const {
  // By way of the entity's parameters, which all its nodes share.
  std::array<uint32_t, 3> parameters{};
  for (unsigned a = 0; a < 3; ++a) {
    const unsigned axis = of.swept->axis[a];
    if (from.parameter[axis] < 0) continue;
    const bool turned = from.flipped[axis] != (a == 2 && of.swept->backwards);
    parameters[static_cast<unsigned>(from.parameter[axis])] = turned ? of.divisions[a] - at[a] : at[a];
  }
  const BlockOrder& b = of_block_[node / per_block];
  const BlockTopology::Node& map = topology_.nodes[node];
  Place result{};
  for (unsigned a = 0; a < 3; ++a) {
    const unsigned axis = b.swept->axis[a];
    const bool backwards = a == 2 && b.swept->backwards;
    const uint32_t where = place(node % per_block, axis);
    if (map.parameter[axis] >= 0) {
      const uint32_t parameter = parameters[static_cast<unsigned>(map.parameter[axis])];
      result[a] = map.flipped[axis] != backwards ? b.divisions[a] - parameter : parameter;
    } else if (where == 1) {
      result[a] = last ? b.divisions[a] : 0;
    } else {
      result[a] = (where == 2) != backwards ? b.divisions[a] : 0;
    }
  }
  return result;
}

uint64_t SweepOrder::last_cell(uint32_t node, const BlockTopology::Node& from, const Place& at,
                               const BlockOrder& of) const {
  const uint32_t block = node / per_block;
  Place there = moved(of, from, at, node, true);
  const Place& divisions = of_block_[block].divisions;
  // The last cell that has a point is the one behind it along each axis, unless it is at the end.
  for (unsigned a = 0; a < 3; ++a) there[a] = std::min(there[a], divisions[a] - 1);
  return cell(block, there);
}

SweepOrder::Point SweepOrder::point(uint32_t block, const Place& at) const {
  const BlockOrder& b = of_block_[block];
  Place classes{};
  for (unsigned a = 0; a < 3; ++a) classes[a] = class_of(at[a], b.divisions[a]);
  const uint32_t own = node(block, classes);
  const BlockTopology::Node& map = topology_.nodes[own];
  const uint32_t owner = owners_[map.entity];
  Point point;
  point.number = owner == own ? owned_number(block, at)
                              : owned_number(owner / per_block, moved(b, map, at, owner, false));
  for (const uint32_t other : topology_.entities[map.entity]) {
    point.last_cell = std::max(point.last_cell, last_cell(other, map, at, b));
  }
  return point;
}

SweepOrder::Origin SweepOrder::origin(uint32_t block, const Place& at) const {
  const BlockOrder& b = of_block_[block];
  Place classes{};
  for (unsigned a = 0; a < 3; ++a) classes[a] = class_of(at[a], b.divisions[a]);
  const BlockTopology::Node& map = topology_.nodes[node(block, classes)];
  const auto& nodes = topology_.entities[map.entity];
  const uint32_t last = *std::max_element(nodes.begin(), nodes.end());
  const Place there = moved(b, map, at, last, false);
  const BlockOrder& o = of_block_[last / per_block];
  Origin origin;
  origin.block = last / per_block;
  for (unsigned a = 0; a < 3; ++a) {
    const bool backwards = a == 2 && o.swept->backwards;
    origin.at[o.swept->axis[a]] = backwards ? o.divisions[a] - there[a] : there[a];
  }
  return origin;
}

}  // namespace maille
