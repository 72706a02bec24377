#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/bytes.h"

namespace maille {

/// A cell of a mesh that is read in parts.
struct PackedCell {
  uint64_t number = 0;  ///< in the mesh
  uint32_t block = 0;
  uint8_t type = 0;
  std::vector<uint64_t> nodes;
  std::vector<uint32_t> faces;  ///< corners of each, of polyhedra
};

/// Cells with rising numbers one behind the other in few bytes, for temporary files: what differs from the
/// cell before. A hexahedron of a lattice takes ten bytes; its nodes alone would be 64. Packer and unpacker
/// begin together, and no cell can be read without those before it.
class CellPacker {
 public:
  void pack(uint64_t number, uint32_t block, uint8_t type, std::span<const uint64_t> nodes,
            std::span<const uint32_t> faces, ByteWriter& out);

 private:
  PackedCell before_;
  uint64_t next_ = 0;
};

/// Inverse of CellPacker, on bytes that this process wrote: it trusts them.
class CellUnpacker {
 public:
  /// The next cell, which stays until the one after it.
  const PackedCell& unpack(ByteReader& in);

 private:
  PackedCell cell_;
  uint64_t next_ = 0;
};

}  // namespace maille
