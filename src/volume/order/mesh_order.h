#pragma once

#include <maille/mesh.h>
#include <maille/source.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "volume/cells/decisions.h"
#include "volume/order/gate_order.h"

namespace maille {

// The input's order of cells and points, for meshes that are coded in another one: where cells come in no
// order that the hull could follow, each costs two numbers of points as large as the mesh. Coded in the order
// of the front and put back behind it, it costs one number below what is left, and less where cells still
// follow one another or their points. 13 to 14 bits a hexahedron of a scattered file fall to 4.2 to 9.0 so
// (docs/history.md, "Scattered files"). docs/format.md, 16.10.
// Encoder and decoder both look things up in the decoded mesh, so all of it must be in memory: at most 2^32
// points and cells.

/// By block, the cell that stands at each place of the coded order; none: as they are.
using CellOrders = std::vector<std::vector<uint64_t>>;

/// Stream "ordr" of a file: how the order is coded, and its two coded sequences.
struct CodedOrder {
  Mixing mixing = Mixing::none;
  bool plain = false;  ///< differences, not neighbours: fast both ways, and a few bits an element larger
  bool points_only = false;  ///< cells stay as they are coded
  std::vector<std::byte> points, cells;
};

/// Stream "ordr" of a file, put together and taken apart.
std::vector<std::byte> join_order(const CodedOrder& order);
/// None: the bytes are damaged.
std::optional<CodedOrder> split_order(Bytes bytes);

/// Whether every cell has a shape of its own: then the order can stand apart.
bool all_have_shapes(const Mesh& mesh);

/// Codes the input's order of a mesh whose cells all have shapes. `orders` and `turns` say how the mesh is
/// coded; with `points_only` cells keep the coded order.
CodedOrder encode_order(const Mesh& mesh, const CellOrders& orders, const CellTurns& turns, Mixing mixing,
                        bool points_only);
/// The same as differences of numbers: larger, and two to three times as fast.
CodedOrder encode_plain_order(const Mesh& mesh, const CellOrders& orders, const CellTurns& turns,
                              bool points_only);

/// Of a permutation: where each number stands in it.
std::vector<uint32_t> inverse(const std::vector<uint32_t>& sequence);

/// Where the input's points and cells stand in the coded order: points[i] is the number there of its point i,
/// cells[i] that of its cell i, through all blocks.
struct InputOrder {
  std::vector<uint32_t> points, cells;
};
/// `coded`: blocks of the mesh in the coded order. None: the bytes are damaged. What is returned are
/// permutations of all points and cells.
std::optional<InputOrder> decode_order(const Mesh& coded, const CodedOrder& order);

/// Puts the cells and points of a mesh, with all arrays, from the coded order into the input's. False: the
/// bytes are damaged.
bool restore_order(Mesh& mesh, const CodedOrder& order);

}  // namespace maille
