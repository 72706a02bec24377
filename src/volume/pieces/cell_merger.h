#pragma once

#include <maille/mesh_source.h>

#include <optional>
#include <string>
#include <vector>

#include "volume/pieces/packed_cells.h"
#include "volume/pieces/scratch_lists.h"

namespace maille {

/// Cells of pieces, put into the order of the mesh by way of a temporary file: each piece has them in that
/// order, so that all are merged in one pass. Memory is a group of cells for each piece, and some thousand on
/// their way out.
class CellMerger {
 public:
  /// `numbered`: cells have their numbers in the mesh, and go by them; else by block, then by piece. `mesh`
  /// and `sink` must outlive it.
  static Result<CellMerger> create(const MeshDescription& mesh, MeshSink& sink, size_t pieces, bool numbered,
                                   const std::string& folder);

  /// The next cell of a piece. `number`: rising within the piece; `values`: its tuples of all arrays on
  /// cells.
  Result<> add(size_t piece, uint64_t number, uint32_t block, uint8_t type, std::span<const uint64_t> nodes,
               std::span<const uint32_t> faces, Bytes values);
  /// Behind the last cell of a piece; pieces are added one after the other.
  Result<> end_piece(size_t piece);
  /// Gives all cells to the sink. False: they are not those of the mesh (a number twice or missing, another
  /// block), whatever a damaged file said of them.
  Result<bool> merge();

 private:
  /// A piece that is read again, some cells at a time.
  struct Cursor {
    ScratchLists::Place place;
    std::vector<std::byte> group;
    std::optional<ByteReader> in;
    CellUnpacker unpacker;
    const PackedCell* cell = nullptr;  ///< nullptr: there is no more
    Bytes values;
  };
  struct Next {
    uint64_t order;
    size_t piece;
    bool operator>(const Next& other) const {
      return order != other.order ? order > other.order : piece > other.piece;
    }
  };
  CellMerger(const MeshDescription& mesh, MeshSink& sink, bool numbered, ScratchLists lists);
  Result<> end_group(size_t piece);
  Result<> advance(size_t piece);
  Next next_of(size_t piece) const;
  Result<bool> put(const PackedCell& cell, Bytes values);
  Result<> flush();

  const MeshDescription& mesh_;
  MeshSink& sink_;
  bool numbered_;
  ScratchLists lists_;
  std::vector<size_t> columns_;  ///< arrays on cells
  size_t values_size_ = 0;
  CellPacker packer_;
  ByteWriter group_;  ///< of the piece that is added
  size_t in_group_ = 0;
  std::vector<Cursor> cursors_;
  // Cells on their way to the sink.
  uint64_t first_ = 0;
  size_t block_ = 0;
  uint64_t block_end_ = 0;
  CellPiece cells_;
  std::vector<std::vector<std::byte>> values_;
};

}  // namespace maille
