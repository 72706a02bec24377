// decode() of pieces into a mesh that is written in parts.
#include <maille/out_of_core.h>

#include <algorithm>
#include <numeric>

#include "base/pace.h"
#include "base/result.h"
#include "mesh/cell_faces.h"
#include "numbers/number_map.h"
#include "volume/pieces/cell_merger.h"
#include "volume/pieces/in_rounds.h"
#include "volume/pieces/piece_reader.h"
#include "volume/pieces/pieces_file.h"
#include "volume/pieces/shared_numbers.h"
#include "volume/stream/number_set.h"

namespace maille {
namespace {

std::array<double, 3> position_of(const Array& positions, uint32_t point) {
  std::array<double, 3> at;
  const size_t size = size_of(positions.type);
  for (unsigned k = 0; k < 3; ++k)
    at[k] = number_as_double(positions.type, positions.bytes.data() + (size_t{3} * point + k) * size);
  return at;
}

/// Writes pieces where they belong, one after the other. With the input's order points go to their numbers;
/// without it they are numbered as they come, and shared points are found by their places (shared_numbers.h).
/// Cells go straight to the sink where pieces come in the order of the mesh, else through a temporary file
/// (cell_merger.h).
class PiecesFeeder {
 public:
  PiecesFeeder(const PieceReader& reader, const MeshDescription& mesh, MeshSink& sink,
               const DecodeOptions& options)
      : reader_(reader),
        mesh_(mesh),
        sink_(sink),
        kept_(reader.kept()),
        numbers_(options.limits.mesh_bytes / 2),
        shared_(reader.pieces()) {}

  // A file is needed only where pieces do not come in the order of the mesh.
  Result<> begin(const WorkingSpace& space) {
    const auto filled = std::count_if(mesh_.blocks.begin(), mesh_.blocks.end(),
                                      [](const MeshDescription::Block& block) { return block.cells > 0; });
    if (!kept_ && filled <= 1) return {};  // piece after piece is the order of the mesh
    merger_.emplace(
        MAILLE_TRY(CellMerger::create(mesh_, sink_, reader_.pieces().size(), kept_, space.folder)));
    return {};
  }

  // Values before cells, as some formats have these within the cells.
  Result<> add(uint32_t number, const DecodedPiece& piece) {
    MAILLE_CHECK(reader_.hold_against_index(number, piece));
    if (kept_) {
      MAILLE_CHECK(take_numbers(piece));
    } else {
      join(number, piece);
    }
    MAILLE_CHECK(write_points(
        piece.mesh.points, [&](uint64_t first, Bytes tuples) { return sink_.write_points(first, tuples); }));
    for (size_t i = 0; i < piece.mesh.arrays.size(); ++i) {
      if (piece.mesh.arrays[i].domain != Domain::point) continue;
      MAILLE_CHECK(write_points(piece.mesh.arrays[i], [&](uint64_t first, Bytes tuples) {
        return sink_.write_array(i, first, tuples);
      }));
    }
    return merger_ ? sort_cells(number, piece) : write_cells(piece);
  }

  Result<> finish() {
    // Counts tell what no piece alone can: that one is missing or there twice.
    const bool whole = merger_ ? MAILLE_TRY(merger_->merge()) : next_cell_ == mesh_.cells;
    if (!whole || points_ != mesh_.points)
      return failure(ErrorCode::corrupt,
                     reader_.name() + ": the pieces do not hold what the file's end says");
    return sink_.commit();
  }

 private:
  /// Takes the numbers of points in the input; those that came before are written once. A bit for each point
  /// is all that is remembered.
  Result<> take_numbers(const DecodedPiece& piece) {
    point_numbers_.assign(piece.numbers.points.begin(), piece.numbers.points.end());
    is_new_.resize(point_numbers_.size());
    for (size_t i = 0; i < point_numbers_.size(); ++i) {
      if (point_numbers_[i] >= mesh_.points)
        return failure(ErrorCode::corrupt, reader_.name() + ": the pieces do not fit: numbers of points");
      is_new_[i] = numbers_.add(point_numbers_[i]) ? 1 : 0;
      points_ += is_new_[i];
    }
    if (numbers_.full())
      return failure(ErrorCode::memory_bound, reader_.name() + ": the points take more memory than allowed");
    return {};
  }

  /// Joins a piece to those before: new points follow one another; the others have the numbers that earlier
  /// pieces gave them.
  void join(uint32_t number, const DecodedPiece& piece) {
    const Array& positions = piece.mesh.points;
    const auto count = static_cast<uint32_t>(piece.mesh.point_count());
    point_numbers_.resize(count);
    is_new_.assign(count, 1);
    auto shared = piece.shared.begin();
    for (uint32_t i = 0; i < count; ++i) {
      point_numbers_[i] = points_;
      if (shared != piece.shared.end() && shared->point == i) {
        point_numbers_[i] =
            shared_.find_or_add(place_of(positions, i), shared->copy, position_of(positions, i), points_);
        ++shared;
      }
      is_new_[i] = point_numbers_[i] == points_ ? 1 : 0;
      points_ += is_new_[i];
    }
    shared_.end_piece(number);
  }

  /// Writes the tuples of points that are new, neighbours at once.
  template <class Write>
  Result<> write_points(const Array& array, Write write) const {
    const size_t size = array.tuple_size();
    for (size_t i = 0, end = 0; i < point_numbers_.size(); i = end) {
      end = i + 1;
      if (is_new_[i] == 0) continue;
      while (end < point_numbers_.size() && is_new_[end] != 0 &&
             point_numbers_[end] == point_numbers_[end - 1] + 1)
        ++end;
      MAILLE_CHECK(write(point_numbers_[i], Bytes(array.bytes).subspan(i * size, (end - i) * size)));
    }
    return {};
  }

  /// visit(block of the mesh, block, cell) -> Result<>
  template <class Visit>
  static Result<> visit_cells(const DecodedPiece& piece, Visit visit) {
    for (size_t b = 0; b < piece.blocks.size(); ++b) {
      const CellBlock& block = piece.mesh.blocks[b];
      const uint64_t cells = block.size();
      for (uint64_t i = 0; i < cells; ++i) MAILLE_CHECK(visit(piece.blocks[b], block, i));
    }
    return {};
  }
  // The points of a cell by their numbers in the mesh; valid until the next call.
  std::span<const uint64_t> nodes_of_cell(const CellBlock& block, uint64_t i) {
    nodes_.clear();
    for (const uint32_t point : block.cell(i)) nodes_.push_back(point_numbers_[point]);
    return nodes_;
  }

  Result<> sort_cells(uint32_t number, const DecodedPiece& piece) {
    std::vector<const Array*> columns;
    for (const Array& array : piece.mesh.arrays) {
      if (array.domain == Domain::cell) columns.push_back(&array);
    }
    uint64_t cell = 0;
    MAILLE_CHECK(visit_cells(piece, [&](uint32_t b, const CellBlock& block, uint64_t i) -> Result<> {
      values_.clear();
      for (const Array* column : columns) {
        const size_t size = column->tuple_size();
        const Bytes tuple = Bytes(column->bytes).subspan(cell * size, size);
        values_.insert(values_.end(), tuple.begin(), tuple.end());
      }
      const uint64_t rising = kept_ ? piece.numbers.cells[cell] : cell;
      ++cell;
      return merger_->add(number, rising, b, static_cast<uint8_t>(block.type_of(i)), nodes_of_cell(block, i),
                          block.faces(i), values_);
    }));
    return merger_->end_piece(number);
  }

  /// Writes the cells of a piece, some thousand at once, behind their values: some formats have these within
  /// the cells.
  Result<> write_cells(const DecodedPiece& piece) {
    for (size_t i = 0; i < piece.mesh.arrays.size(); ++i) {
      if (piece.mesh.arrays[i].domain == Domain::cell)
        MAILLE_CHECK(sink_.write_array(i, next_cell_, piece.mesh.arrays[i].bytes));
    }
    MAILLE_CHECK(visit_cells(piece, [&](uint32_t, const CellBlock& block, uint64_t i) -> Result<> {
      if (cells_.offsets.empty()) cells_.offsets.push_back(0);
      append_cell(block.type_of(i), nodes_of_cell(block, i), block.faces(i), cells_);
      constexpr size_t at_once = 4096;
      return cells_.size() < at_once ? Result<>() : flush();
    }));
    return flush();
  }
  Result<> flush() {
    if (cells_.size() == 0) return {};
    MAILLE_CHECK(sink_.write_cells(cells_));
    next_cell_ += cells_.size();
    cells_ = {};
    return {};
  }

  const PieceReader& reader_;
  const MeshDescription& mesh_;
  MeshSink& sink_;
  bool kept_;
  NumberSet numbers_;
  SharedNumbers shared_;
  std::optional<CellMerger> merger_;
  std::vector<uint64_t> point_numbers_;  ///< of the piece
  std::vector<uint8_t> is_new_;
  uint64_t points_ = 0, next_cell_ = 0;
  CellPiece cells_;
  std::vector<uint64_t> nodes_;
  std::vector<std::byte> values_;
};

}  // namespace

/// Two pieces are decoded at once, while the ones before are written: memory is for about four.
Result<> decode_pieces(const Source& source, MeshSink& sink, const DecodeOptions& options,
                       const WorkingSpace& space) {
  const MeshDescription mesh = MAILLE_TRY(describe(source, options));
  const PieceReader reader = MAILLE_TRY(PieceReader::open(source, options));
  MAILLE_CHECK(reader.file().check_complete());
  PiecesFeeder feeder(reader, mesh, sink, options);
  MAILLE_CHECK(feeder.begin(space));
  constexpr size_t at_once = 2;
  const size_t count = reader.pieces().size();
  Executor& executor = options.executor ? *options.executor : serial_executor();
  MAILLE_CHECK((in_rounds<size_t, DecodedPiece>(
      executor, count, at_once, [](size_t piece) -> Result<size_t> { return piece; },
      [&](size_t, size_t piece) {
        return reader.read(static_cast<uint32_t>(piece), reader.kept(), options.limits.mesh_bytes / at_once);
      },
      [&](size_t piece, const DecodedPiece& decoded) -> Result<> {
        MAILLE_CHECK(feeder.add(static_cast<uint32_t>(piece), decoded));
        const double share = static_cast<double>(piece + 1) / static_cast<double>(count);
        return options.progress && !options.progress({"cells", share}) ? cancelled() : Result<>();
      })));
  return feeder.finish();
}

}  // namespace maille
