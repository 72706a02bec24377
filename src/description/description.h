#pragma once

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/limits.h>
#include <maille/mesh.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "description/block_cells.h"
#include "mesh/block_shape.h"

namespace maille {

/// What options ask for of the array of this name.
inline Tolerance tolerance_of(const EncodeOptions& options, const std::string& name) {
  const auto found = options.arrays.find(name);
  return found == options.arrays.end() ? Tolerance{} : found->second;
}

/// Whether options ask for arrays of this name; where they name none, all are wanted.
bool is_wanted(const DecodeOptions& options, const std::string& name);

/// One array as a file describes it, without its numbers. `asked`, `bound` and `step`: what was asked for,
/// the largest error that is promised, and the step of the lattice; in the array's units, 0 where it is
/// lossless.
struct ArrayDescription {
  std::string name;
  Domain domain = Domain::point;
  bool by_twin = false;  ///< coded on corners, but a point's: see Description::welded
  Scalar type = Scalar::f32;
  uint32_t components = 1;
  Role role = Role::none;
  std::vector<std::string> labels;
  uint64_t mesh_tuples = 0;  ///< Domain::mesh only
  Tolerance asked;
  double bound = 0;
  double step = 0;
};

/// A block of cells as a file describes it: name, type and number of cells.
struct CodedBlock {
  std::string name;
  BlockShape shape;
  /// Of a mixed block, for information: its cells by type, rising.
  std::vector<std::pair<CellType, uint64_t>> types = {};
  uint32_t number = 0;  ///< in a description of a part: the block's place among those of the whole mesh
};

/// What one part of a mesh holds, for meshes of several parts.
struct PartDescription {
  uint32_t points = 0;
  uint64_t corners = 0;
  std::vector<BlockCells> cells;  ///< of the blocks that have some, rising
};

/// Everything about a mesh that can be known without decoding it: the first thing that every reader needs,
/// and what `maille info` shows. docs/format.md, 11.1. Counts and blocks are those of the whole mesh, or of a
/// part after of_part().
struct Description {
  uint8_t effort = 5;
  Order order = Order::canonical;
  bool welded = false;        ///< coded with twins as one point (surface/weld.h)
  uint32_t points = 0;        ///< as coded
  uint32_t split_points = 0;  ///< of the mesh, if it is welded
  uint64_t corners = 0;
  std::vector<CodedBlock> blocks;
  std::vector<PartDescription> parts;  ///< empty: the mesh is one
  ArrayDescription positions;
  std::vector<ArrayDescription> arrays;
  std::vector<std::pair<std::string, std::string>> metadata;
  std::string provenance;
  uint64_t memory = 0;  ///< what a decoded description takes, in bytes, but for its blocks

  uint64_t cells() const;
  uint64_t tuples(const ArrayDescription& array) const;
  std::vector<BlockShape> shapes() const;
  /// Of a part: its blocks' places among those of the whole mesh.
  std::vector<uint32_t> block_numbers() const;
  /// What the blocks take in memory, in bytes.
  uint64_t block_memory() const;
  /// Of a part as a mesh of its own: with the blocks that have cells in it. Arrays that belong to the mesh as
  /// a whole are those of part 0.
  Description of_part(size_t part) const;
  /// The same for another part of the same mesh, without a copy of its arrays.
  void take_part(const Description& whole, size_t part);
};

/// The blocks that have cells in a part, with so many cells; without their names, which a million parts may
/// share, and without their types.
std::vector<CodedBlock> blocks_of_part(const std::vector<CodedBlock>& whole,
                                       const std::vector<BlockCells>& cells);

/// The bytes that the mesh described takes in memory; in doubles: sums of claimed counts must not wrap
/// around.
double memory_of(const Description& description);

/// The description as bytes. Error: unsupported, for more than 16 MiB of names, labels and metadata.
Result<std::vector<std::byte>> encode_description(const Description& description);

/// The inverse. Safe on any bytes. Errors: corrupt; memory_bound, when the mesh described, or the description
/// itself, is larger than `limits` allow. Nothing is allocated by a claimed count: names and lists grow as
/// they are read.
Result<Description> decode_description(Bytes bytes, const Limits& limits);

}  // namespace maille
