#pragma once

#include <maille/generate.h>
#include <array>
#include <cstdint>
#include <vector>

namespace maille {

/// Corner of a block at (x, y, z), each 0 or 1.
inline unsigned corner_at(unsigned x, unsigned y, unsigned z) {
  return 4 * z + (y != 0 ? 3 - x : x);
}

/// Edge of a block along `axis`; u and v, each 0 or 1, are its place along the other two axes, in order.
inline unsigned edge_at(unsigned axis, unsigned u, unsigned v) {
  constexpr unsigned place[2][2] = {{0, 3}, {1, 2}};  // by u, then v
  return 4 * axis + place[u][v];
}

/// Which points of blocks are one point. A block has 27 *nodes*: 8 corners, 12 edges, 6 faces without their
/// borders and the interior, numbered by (place along x) + 3 y + 9 z with places 0 first, 1 between, 2 last.
/// Nodes joined by shared faces, and edges collapsed to a point, make *entities*. All points of an entity are
/// named by at most three parameters, whatever block they are seen from.
struct BlockTopology {
  static constexpr unsigned nodes_per_block = 27;

  /// How a node lies on its entity.
  struct Node {
    uint32_t entity = 0;
    /// For each axis of the block: which parameter of the entity it is; -1 where the node does not extend
    /// along it or all its points there are one.
    std::array<int8_t, 3> parameter{-1, -1, -1};
    /// The parameter runs backwards along this axis.
    std::array<bool, 3> flipped{};
  };
  struct Neighbour {
    int32_t block = -1;  ///< -1: none
    uint8_t face = 0;
    /// Where each of the three axes of this block goes in the other, and whether it is turned over.
    std::array<uint8_t, 3> axis{};
    std::array<bool, 3> flipped{};
  };

  /// Cells along each axis, refined.
  std::vector<std::array<uint32_t, 3>> divisions;
  std::vector<Node> nodes;                           ///< 27 for each block
  std::vector<std::vector<uint32_t>> entities;       ///< the nodes of each
  std::vector<std::array<Neighbour, 6>> neighbours;  ///< of faces x first, x last, y first, ...
  std::vector<std::array<bool, 12>> collapsed;       ///< edges whose points are all one
  std::vector<std::array<int32_t, 12>> curve;        ///< of each edge, in the description; -1: straight
  std::vector<std::array<int32_t, 6>> patch;         ///< of each face; -1: inside, or nowhere
  std::vector<BlockPatch> patches;  ///< without faces; the default patch last if it is needed

  /// Whether points of the entity are those of no other node.
  bool alone(uint32_t node) const { return entities[nodes[node].entity].size() == 1; }
  /// Whether a cell of the block may have a point twice, by its own collapsed edges or by what its neighbours
  /// join.
  bool repeats_points(size_t block) const;
};

/// Checks a description and joins its blocks; `refine` multiplies the cells along each axis. Errors:
/// malformed_input, unsupported; naming blocks.
Result<BlockTopology> join_blocks(const BlockDescription& description, uint32_t refine);

/// How messages call a block: "block 3", "block 3 (name)".
std::string block_text(const BlockDescription& description, size_t block);

}  // namespace maille
