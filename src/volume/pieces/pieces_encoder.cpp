#include <algorithm>
#include <utility>

#include "base/pace.h"
#include "base/result.h"
#include "surface/arrays/array_report.h"
#include "volume/pieces/number_cut.h"
#include "volume/pieces/piece_coder.h"
#include "volume/pieces/pieces_file.h"
#include "volume/stream/numbered_arrays.h"

namespace maille {
namespace {

/// A mesh in memory in pieces: cut, coded side by side, joined by their shared points, written one after the
/// other.
class PiecesEncoder {
 public:
  PiecesEncoder(const Mesh& mesh, PieceCoding coding)
      : mesh_(mesh),
        coding_(std::move(coding)),
        executor_(coding_.options.executor ? *coding_.options.executor : serial_executor()) {
    coding_.cells = mesh.cell_count();
  }

  Result<EncodeReport> run(Sink& sink, uint64_t target) {
    cells_ = cut_into_pieces(mesh_, target, coding_.kept(), executor_);
    pieces_.resize(cells_.size());
    MAILLE_CHECK(code_all());
    MAILLE_CHECK(code_unused());
    join();
    return write(sink);
  }

 private:
  /// Pieces coded between two looks at progress. Their number does not depend on threads; nothing in the file
  /// depends on it.
  static constexpr size_t at_once = 32;

  Result<> code_all() {
    for (size_t first = 0; first < pieces_.size(); first += at_once) {
      const size_t count = std::min(at_once, pieces_.size() - first);
      std::vector<Result<>> done(count);
      executor_.parallel_for(count, [&](size_t i) { done[i] = code(first + i); });
      for (const Result<>& each : done) MAILLE_CHECK(each);
      const double share = static_cast<double>(first + count) / static_cast<double>(pieces_.size());
      if (coding_.options.progress && !coding_.options.progress({"cells", share})) return cancelled();
    }
    return {};
  }

  // The list of cells is given away: it is needed no more, and may be large.
  Result<> code(size_t number) {
    SubMesh sub = take_cells(mesh_, cells_[number]);
    pieces_[number] = MAILLE_TRY(code_piece(coding_, std::move(sub), std::move(cells_[number])));
    return {};
  }

  /// Points that no cell uses are a piece of their own, the last one.
  Result<> code_unused() {
    std::vector<uint8_t> used(mesh_.point_count());
    for (const PieceInWork& piece : pieces_) {
      for (const uint32_t point : piece.coded_points) used[point] = 1;
    }
    std::vector<uint32_t> unused;
    for (uint32_t point = 0; point < used.size(); ++point) {
      if (used[point] == 0) unused.push_back(point);
    }
    if (unused.empty()) return {};
    pieces_.push_back(MAILLE_TRY(code_piece(coding_, take_points(mesh_, std::move(unused)), {})));
    return {};
  }

  /// Finds which points pieces share, when all are coded: each piece then tells its own in its coded order.
  /// Where positions have loss, a point is known by its decoded place.
  void join() {
    std::vector<std::span<const uint32_t>> points;
    for (const PieceInWork& piece : pieces_) points.emplace_back(piece.coded_points);
    std::vector<Place> places;
    if (coding_.maps.bounds[0] > 0) places.resize(mesh_.point_count());
    for (PieceInWork& piece : pieces_) {
      for (size_t i = 0; i < piece.places.size(); ++i) places[piece.coded_points[i]] = piece.places[i];
      piece.places = {};
    }
    const auto shared = find_shared(points, static_cast<uint32_t>(mesh_.point_count()), [&](uint32_t point) {
      return places.empty() ? place_of(mesh_.points, point) : places[point];
    });
    numbers_.resize(pieces_.size());
    executor_.parallel_for(pieces_.size(), [&](size_t p) {
      PieceInWork& piece = pieces_[p];
      const auto count = static_cast<uint32_t>(piece.coded_points.size());
      piece.coded.shared = encode_shared(shared[p], count, piece.border, piece.on_side);
      if (coding_.kept()) numbers_[p] = encode_numbers(std::exchange(piece.numbers, {}));
    });
  }

  // Ranges are those of the mesh, in which each point is there once.
  StreamTail tail(const EncodeReport& report) const {
    StreamTail tail;
    tail.points = mesh_.point_count();
    tail.cells = mesh_.cell_count();
    tail.batches = pieces_.size();
    for (const CellBlock& block : mesh_.blocks) tail.blocks.push_back({block.name, block.type, block.size()});
    set_totals(count_cells(mesh_), tail);
    widen(tail.ranges.emplace_back(), mesh_.points.type, 3, mesh_.points.bytes);
    for (const Array& array : mesh_.arrays) {
      if (array.domain != Domain::mesh)
        widen(tail.ranges.emplace_back(), array.type, array.components, array.bytes);
    }
    unsign_zeros(tail);
    tail.errors = errors_of(report);
    return tail;
  }

  /// What the pieces say of themselves, added up.
  EncodeReport sum() const {
    EncodeReport report = report_of(mesh_);
    report.positions = report_of(mesh_.points);
    for (const Array& array : mesh_.arrays) report.arrays.push_back(report_of(array));
    for (const PieceInWork& piece : pieces_) add_report(piece.report, report);
    return report;
  }

  /// The order of chunks is that of docs/format.md, 16.14. Bytes of a piece are let go of once they are
  /// written.
  Result<EncodeReport> write(Sink& sink) {
    EncodeReport report = sum();
    FileWriter file = MAILLE_TRY(begin_file(sink, coding_));
    for (uint32_t p = 0; p < pieces_.size(); ++p) {
      MAILLE_CHECK(file.write_stream({"PIEC", p, 0}, encode_piece(pieces_[p].coded)));
      pieces_[p].coded = {};
    }
    for (uint32_t p = 0; p < pieces_.size() && coding_.kept(); ++p) {
      report.order_bytes += numbers_[p].size();
      MAILLE_CHECK(file.write_stream({"GIDS", p, 0}, numbers_[p]));
    }
    std::vector<PieceRecord> records;
    for (PieceInWork& piece : pieces_) records.push_back(std::move(piece.record));
    MAILLE_CHECK(write_index(file, records));
    MAILLE_CHECK(file.write_stream({"TAIL"}, encode_tail(tail(report))));
    report.file_bytes = MAILLE_TRY(file.finish());
    MAILLE_CHECK(sink.commit());
    set_other_bytes(report);
    return report;
  }

  const Mesh& mesh_;
  PieceCoding coding_;
  Executor& executor_;
  std::vector<std::vector<uint32_t>> cells_;  ///< by piece
  std::vector<PieceInWork> pieces_;
  std::vector<std::vector<std::byte>> numbers_;  ///< by piece its GIDS, of an order that is kept
};

}  // namespace

Result<EncodeReport> encode_in_pieces(const Mesh& mesh, Sink& sink, const EncodeOptions& options,
                                      uint64_t target) {
  MAILLE_CHECK(validate(mesh));
  if (target == 0) return failure(ErrorCode::usage, "a piece must have room for a cell");
  if (mesh.cell_count() > max_points)
    return failure(ErrorCode::unsupported,
                   "a mesh in memory of more than 2^32 cells cannot be cut into pieces");
  StreamOptions stream = MAILLE_TRY(stream_options_of(mesh, options));
  ArrayMapsList maps = MAILLE_TRY(choose_stream_maps(mesh, stream));
  if (options.order == Order::keep) set_numbered(find_numbered(mesh), maps);
  return PiecesEncoder(mesh, {options, std::move(stream), std::move(maps)}).run(sink, target);
}

}  // namespace maille
