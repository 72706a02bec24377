#pragma once

#include <maille/mesh_source.h>

#include "base/bytes.h"
#include "base/scratch_file.h"

namespace maille {

/// Cells in a temporary file: written once, one behind the other, then read anywhere. Memory is one block for
/// each direction and 16 bytes for each block of the file. Readers in file order decode each block once; one
/// that jumps decodes a block for each jump. Points are below 2^32.
class CellFile {
 public:
  /// `folder`: as ScratchFile has it.
  static Result<CellFile> create(const std::string& folder);

  /// Appends a cell. `face_sizes`: of a polyhedron, whose nodes are the corners of its faces, one face behind
  /// the other. Errors: those of the temporary file.
  Result<> add(CellType type, std::span<const uint32_t> nodes, std::span<const uint32_t> face_sizes = {});
  /// Writes what the last block holds. Call it behind the last cell, before read().
  Result<> end() { return flush(); }
  uint64_t cells() const { return cells_; }
  uint64_t corners() const { return corners_; }

  // Replaces `out` by cells first ... first + count - 1. Errors: usage, where there are not as many.
  Result<> read(uint64_t first, uint64_t count, CellPiece& out);

 private:
  explicit CellFile(ScratchFile file) : file_(std::move(file)) {}
  // Both chosen, not swept. Larger blocks would make jumps dearer, as blocks are read whole; smaller ones
  // would take more entries of `blocks_` and more calls to the system. The bound in bytes is for polyhedra of
  // many faces.
  static constexpr uint64_t cells_per_block = 4096;
  static constexpr size_t bytes_per_block = size_t{1} << 20;
  struct Block {
    uint64_t first_cell, at;
  };
  Result<> flush();
  Result<> load(size_t block);
  void take_cell(ByteReader& in);

  ScratchFile file_;
  std::vector<Block> blocks_;
  uint64_t cells_ = 0, corners_ = 0;
  ByteWriter block_;
  uint64_t cells_in_block_ = 0;
  uint32_t last_ = 0;  ///< point
  CellPiece loaded_;
  size_t loaded_block_ = ~size_t{0};
};

/// Appends cells first ... first + count - 1 of a piece.
void append_cells(const CellPiece& from, uint64_t first, uint64_t count, CellPiece& out);

}  // namespace maille
