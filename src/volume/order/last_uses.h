#pragma once

#include <maille/out_of_core.h>

#include <vector>

#include "base/scratch_file.h"

namespace maille {

/// Which entries of a mesh's connectivity are the last use of their point, found out of core: the cells are
/// read backwards, with a bit for each point that was seen; where the bits of all points are too many, once
/// for each range of points that fits. The flags, a bit for each entry, are in a temporary file: a hexahedron
/// takes one byte of disk.
class LastUses {
 public:
  /// Cells whose flags are read at once.
  static constexpr uint64_t step = 4096;

  /// Finds all flags. Cells are read while those behind them are looked at. Errors: those of reading `mesh`,
  /// write_failed, cancelled.
  static Result<LastUses> find(MeshSource& mesh, const WorkingSpace& space, const EncodeOptions& options);

  /// Flags of the cells from step * `block` on, which have so many corners.
  Result<> read(uint64_t block, size_t corners, std::vector<uint8_t>& flags);
  /// By block of the mesh: its type; where the file does not tell, the type that all its cells have, or
  /// mixed.
  const std::vector<CellType>& common_types() const { return common_types_; }
  /// Points that no cell uses, from `first` on, ascending, some thousand of them at most; none: there are no
  /// more.
  Result<std::vector<uint64_t>> unused(uint64_t first);
  /// How many points were used and will be used again, at most, as counted after each block of cells: within
  /// a block it may be more. It takes a pass over the cells for each range of points.
  Result<uint64_t> most_in_use(MeshSource& mesh, const WorkingSpace& space);

 private:
  Result<> count_in_use(MeshSource& mesh, uint64_t first_point, uint64_t points,
                        std::vector<int64_t>& changes);
  LastUses(ScratchFile flags, ScratchFile seen) : flags_(std::move(flags)), seen_(std::move(seen)) {}
  // One reading of all cells backwards, for a range of points.
  Result<> pass(MeshSource& mesh, uint64_t first_point, uint64_t points, Executor& executor);
  Result<> mark(uint64_t block, const CellPiece& cells, uint64_t first_point, std::vector<uint64_t>& seen);
  void note_types(const CellPiece& cells);

  ScratchFile flags_, seen_;
  std::vector<std::byte> bits_;   ///< of a block
  std::vector<uint64_t> begins_;  ///< of the flags of each block, in the file; blocks are there from the last
  std::vector<CellType> common_types_;
  bool one_unknown_ = false;  ///< one block, of which it is not told what it holds
  uint64_t points_ = 0;
};

}  // namespace maille
