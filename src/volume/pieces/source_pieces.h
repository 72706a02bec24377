#pragma once

#include <maille/out_of_core.h>

#include <memory>
#include <optional>
#include <vector>

#include "volume/pieces/bisection.h"
#include "volume/pieces/number_cut.h"
#include "volume/pieces/packed_cells.h"
#include "volume/pieces/point_sharing.h"
#include "volume/pieces/scratch_lists.h"
#include "volume/pieces/sub_mesh.h"
#include "volume/stream/source_points.h"

namespace maille {

/// The pieces of a mesh that is read in parts. Its cells go to temporary files, piece by piece, as cuts
/// through a sample of them tell; of each piece the numbers of its points go there as well, and which of them
/// others have. Memory is that of the sample (at most 2^21 middles), of buffers, and of the pieces that are
/// loaded at once.
/// Order of calls: cut(), share(), then read() by one thread and load() by any.
class SourcePieces {
 public:
  /// `mesh` must outlive it. Errors: those of reading it, unsupported (more than 2^32 points or cells),
  /// write_failed, cancelled.
  SourcePieces(MeshSource& mesh, const WorkingSpace& space, const EncodeOptions& options);
  /// Cuts the cells into pieces of about `target`: looked through for the sample, then distributed; again by
  /// number if that is the better way.
  Result<> cut(uint64_t target);
  /// Afterwards. `place_of`: as PointSharing has it.
  Result<> share(const PointSharing::PlaceOf& place_of);

  /// With points that no cell has as pieces of their own, which are the last ones.
  size_t count() const { return cells_->count() + unused_pieces_; }
  bool has_cells(size_t piece) const { return piece < cells_->count(); }
  /// Types of blocks; where the file does not tell, the type that all its cells have, or mixed.
  const std::vector<CellType>& block_types() const { return block_types_; }

  /// What of a piece is read by one thread: files and caches are not shared between threads.
  struct Raw {
    std::vector<std::byte> cells;   ///< packed, with their values
    std::vector<uint32_t> points;   ///< rising
    std::vector<std::byte> tuples;  ///< by point its position and values
    std::vector<SharedPoint> shared;
  };
  /// Pieces in rising order, as points without cells come from one list.
  Result<Raw> read(size_t piece);

  /// A piece as a mesh of its own, and what is known of it.
  struct Loaded {
    SubMesh sub;
    std::vector<uint32_t> cells;  ///< numbers in the mesh
    std::vector<SharedPoint> shared;
  };
  /// Makes a mesh of it; may be called from any thread. Error: malformed_input, where the source gave cells
  /// that are no mesh.
  Result<Loaded> load(Raw raw) const;

 private:
  template <class Visit>
  Result<> visit_cells(const char* stage, Visit visit);
  Result<> sample(std::vector<Middle>& middles, ReachCounts& reaches);
  Result<CellCorners> corners_of(std::span<const uint64_t> nodes);
  Result<> divide(size_t pieces);
  Result<> distribute();
  Result<> list_points();
  LookedAt look_at_pieces() const;
  Result<LookedAt> look_at_numbers(const NumberCut& cut);
  void note_type(uint8_t type);
  uint32_t block_of(uint64_t cell) const;
  const MeshDescription& description() const { return mesh_.description(); }

  MeshSource& mesh_;
  WorkingSpace space_;
  const EncodeOptions& options_;
  Executor& executor_;
  std::vector<uint64_t> block_ends_;  ///< in cells
  std::vector<CellType> block_types_;
  bool one_unknown_ = false;     ///< one block, of which it is not told what it holds
  std::vector<size_t> columns_;  ///< arrays on cells
  size_t values_size_ = 0;       ///< of a cell
  Bisection cuts_;
  std::optional<NumberCut> by_number_;  ///< in the stead of `cuts_`
  std::vector<LookedAt> sizes_;         ///< by piece
  std::optional<SourcePoints> points_;
  std::optional<ScratchLists> cells_, point_lists_;
  std::optional<PointSharing> sharing_;
  // Pieces behind those with cells.
  size_t unused_pieces_ = 0;
  uint64_t unused_in_piece_ = 0;
};

}  // namespace maille
