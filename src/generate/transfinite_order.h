#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "generate/transfinite_topology.h"

namespace maille {

/// In which order blocks are swept. The blocks of a *sweep* advance together, a layer of each in turn. Each
/// block is in one sweep.
struct SweepPlan {
  struct Block {
    uint32_t block = 0;
    /// Axes of the block: along a row of cells, from row to row, from layer to layer.
    std::array<uint8_t, 3> axis{0, 1, 2};
    bool backwards = false;  ///< layers go from the last to the first
  };
  struct Sweep {
    std::vector<Block> blocks;
    uint32_t layers = 0;
  };
  std::vector<Sweep> sweeps;
};

/// Block by block, in their order, layers along z: the order of OpenFOAM's blockMesh.
SweepPlan plan_block_by_block(const BlockTopology& topology);

/// Blocks that stand side by side are swept together, where their layers meet one by one; then comes the
/// sweep that leaves the fewest points waiting. Points shared by blocks live shortly, and what is alive is
/// about a cross-section. Found greedily, in the square of the number of blocks; meshes of more than 4096
/// blocks go block by block.
SweepPlan plan_streaming(const BlockTopology& topology);

/// Numbers of points and cells in the order of a plan, in closed form: no table of points is ever held.
///
/// Coordinates are those of the sweep: along the row, across rows, layer. The points of a layer of a block
/// come with the layer of cells in front of it, those of the first with those of the second. Points are
/// numbered in the order in which they come; each is made by the block that comes by first, its owner.
class SweepOrder {
 public:
  using Place = std::array<uint32_t, 3>;

  /// `topology` must outlive the order.
  SweepOrder(const BlockTopology& topology, SweepPlan plan);

  const SweepPlan& plan() const { return plan_; }
  uint64_t points() const { return points_; }
  uint64_t cells() const { return cells_; }

  /// Cells along the axes of the sweep.
  Place divisions(uint32_t block) const { return of_block_[block].divisions; }
  const SweepPlan::Block& swept(uint32_t block) const { return *of_block_[block].swept; }

  /// The point of a place of a block.
  struct Point {
    uint64_t number = 0;
    uint64_t last_cell = 0;  ///< the last one that has the point
  };
  Point point(uint32_t block, const Place& at) const;
  /// The block makes the points of this node: no other one comes by earlier.
  bool owns(uint32_t block, const Place& classes) const { return owned(of_block_[block], classes); }
  uint64_t cell(uint32_t block, const Place& at) const;
  /// Which of the node's parameters 0, 1 (between), 2 a coordinate has.
  static uint32_t class_of(uint32_t at, uint32_t cells) { return at == 0 ? 0 : at == cells ? 2 : 1; }
  /// Number of a node, from its classes along the axes of the sweep.
  uint32_t node(uint32_t block, const Place& classes) const;
  const BlockTopology& topology() const { return topology_; }

  /// Number of a point the block owns.
  uint64_t owned_number(uint32_t block, const Place& at) const;

  /// The last block (by its number) that has a point, and where, along the block's own axes: this block says
  /// where the point is, in any order of blocks.
  struct Origin {
    uint32_t block = 0;
    Place at{};
  };
  Origin origin(uint32_t block, const Place& at) const;

 private:
  struct BlockOrder {
    const SweepPlan::Block* swept = nullptr;
    Place divisions{};
    uint32_t sweep = 0;
    uint32_t position = 0;  ///< within the sweep
    uint32_t owned = 0;     ///< a bit for each node, by its classes along the axes of the sweep
    /// Points before those of the block, within the step: first (from both layers of points), between, last.
    std::array<uint64_t, 3> points_before{};
    uint64_t first_layer_points = 0;
    uint64_t cells_before = 0;  ///< within a layer of the sweep
  };
  struct SweepNumbers {
    uint64_t first_point = 0;
    std::array<uint64_t, 3> points{};  ///< made in the first step, each between, the last
    uint64_t first_cell = 0;
    uint64_t cells_of_layer = 0;
  };

  static bool owned(const BlockOrder& b, const Place& classes) {
    return (b.owned >> (classes[0] + 3 * classes[1] + 9 * classes[2]) & 1) != 0;
  }
  /// Points of a row or a layer made by the block.
  static uint64_t row_points(const BlockOrder& b, uint32_t row_class, uint32_t layer_class);
  static uint64_t layer_points(const BlockOrder& b, uint32_t layer_class);
  /// Points made by the block in the first step, one between, the last.
  static uint64_t step_points(const BlockOrder& b, unsigned phase);
  static unsigned phase_of(uint32_t step, uint32_t layers) {
    return step == 0 ? 0 : step + 1 == layers ? 2 : 1;
  }
  /// Where in the order the block makes the points of a node; the smallest one owns them.
  std::array<uint32_t, 6> turn_of(uint32_t node) const;
  void choose_owners();
  void number();
  uint64_t last_cell(uint32_t node, const BlockTopology::Node& from, const Place& at,
                     const BlockOrder& of) const;
  /// Moves a place from the node of one block to another node of the same entity; where that has one point
  /// for many, `dropped` (0 or 1) says which end of it: the first or the last.
  Place moved(const BlockOrder& of, const BlockTopology::Node& from, const Place& at, uint32_t node,
              bool last) const;

  const BlockTopology& topology_;
  SweepPlan plan_;
  std::vector<BlockOrder> of_block_;
  std::vector<SweepNumbers> of_sweep_;
  std::vector<uint32_t> owners_;  ///< a node for each entity
  uint64_t points_ = 0;
  uint64_t cells_ = 0;
};

}  // namespace maille
