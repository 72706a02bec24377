#pragma once

#include <maille/executor.h>
#include <maille/mesh.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "description/description.h"
#include "surface/parts/shared_points.h"

namespace maille {

/// A part of a mesh, with the blocks that have cells in it.
struct PartToMerge {
  Mesh mesh;
  std::vector<uint32_t> block_numbers;  ///< by block: its place among those of the whole, rising
};

/// A block of a part.
struct BlockOfPart {
  uint32_t number = 0;  ///< among the blocks of the whole
  uint32_t part = 0;
  uint32_t block = 0;  ///< among those of the part
};
/// The blocks of all parts as the whole has their cells: block after block, in each of them part after part.
template <class Parts>
std::vector<BlockOfPart> blocks_in_order(const Parts& parts) {
  std::vector<BlockOfPart> order;
  for (uint32_t p = 0; p < parts.size(); ++p) {
    for (uint32_t b = 0; b < parts[p].block_numbers.size(); ++b)
      order.push_back({parts[p].block_numbers[b], p, b});
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const BlockOfPart& a, const BlockOfPart& b) { return a.number < b.number; });
  return order;
}

/// The mesh that was cut into these parts: in each block the cells of part after part, points numbered as
/// `joined` says. `blocks` are those of the whole: their names and types. All parts have the same arrays, and
/// there is one part at least; arrays that belong to the mesh as a whole are taken from the first. Positions
/// of joined points are those of the first part that has them.
Mesh merge_parts(std::vector<PartToMerge> parts, std::span<const CodedBlock> blocks,
                 const JoinedPoints& joined, Executor& executor);

}  // namespace maille
