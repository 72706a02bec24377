#pragma once

#include <maille/mesh_source.h>

#include <vector>

#include "base/scratch_file.h"
#include "io/cell_file.h"

namespace maille {

/// A mesh that is written in parts in any order, and then read in parts, in temporary files: for formats
/// whose parts have no place before all is known. Points and arrays stand at their place in a file of their
/// own, each; cells must come in order. Disk: as much as the mesh in memory, but a third or less of that for
/// cells.
class ScratchMesh final : public MeshSource {
 public:
  /// `folder`: as ScratchFile has it.
  static Result<std::unique_ptr<ScratchMesh>> create(const MeshDescription& description,
                                                     const std::string& folder);

  // As MeshSink has them.
  // What goes beyond the description is refused (usage), so nothing can be read that is not there.
  Result<> write_points(uint64_t first, Bytes positions);
  Result<> write_cells(const CellPiece& cells);
  Result<> write_array(size_t array, uint64_t first, Bytes tuples);
  /// Behind the last cell. Error: usage, when there are not as many as described.
  Result<> end();

  const MeshDescription& description() const override { return description_; }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override;
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override {
    return cells_.read(first, count, out);
  }
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override;

 private:
  ScratchMesh(const MeshDescription& description, CellFile cells, ScratchFile points)
      : description_(description), cells_(std::move(cells)), points_(std::move(points)) {}

  MeshDescription description_;
  CellFile cells_;
  ScratchFile points_;
  std::vector<ScratchFile> arrays_;
};

}  // namespace maille
