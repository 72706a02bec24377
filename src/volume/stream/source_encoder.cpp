// encode() of a mesh that is read in parts, mode `stream`.
#include <maille/out_of_core.h>
#include <maille/stream.h>

#include <algorithm>
#include <array>
#include <functional>
#include <utility>

#include "base/pace.h"
#include "base/result.h"
#include "description/description.h"
#include "mesh/cell_faces.h"
#include "surface/arrays/array_report.h"
#include "volume/cells/cell_coder.h"
#include "volume/order/last_uses.h"
#include "volume/order/working_memory.h"
#include "volume/stream/numbered_arrays.h"
#include "volume/stream/source_points.h"
#include "volume/stream/source_report.h"
#include "volume/stream/source_sample.h"
#include "volume/stream/stream_file.h"
#include "volume/stream/stream_layout.h"

namespace maille {
namespace {

/// Points of a source. Who reads them owns the source while cells are coded: before the first point, the next
/// cells are read, too, if that was asked for. So the source is never used by two threads, and reading goes
/// beside coding.
class PointsWithCellsAhead final : public PointSource {
 public:
  PointsWithCellsAhead(MeshSource& mesh, uint64_t memory) : points_(mesh, memory, true) {}
  Result<> read(uint64_t number, std::byte* out) override {
    read_ahead();
    return points_.read(number, out);
  }
  void plan(std::function<void()> ahead) { ahead_ = std::move(ahead); }
  /// Unless that was done.
  void read_ahead() {
    if (ahead_) std::exchange(ahead_, nullptr)();
  }

 private:
  SourcePoints points_;
  std::function<void()> ahead_;
};

/// Hands the cells of a source to a writer, a block of LastUses at a time: the next one is read meanwhile.
/// Two pieces take turns.
class SourceFeeder {
 public:
  SourceFeeder(MeshSource& mesh, PointsWithCellsAhead& points, StreamWriter& writer, LastUses& uses)
      : mesh_(mesh), points_(points), writer_(writer), uses_(uses) {
    for (size_t i = 0; i < mesh.description().arrays.size(); ++i) {
      if (mesh.description().arrays[i].domain == Domain::cell) columns_.push_back(i);
    }
    for (Piece& piece : pieces_) piece.values.resize(columns_.size());
    tuples_.resize(columns_.size());
  }

  Result<> feed(const Progress& progress) {
    const uint64_t cells = mesh_.description().cells;
    if (cells > 0) MAILLE_CHECK(load(0, std::min(LastUses::step, cells), pieces_[0]));
    for (uint64_t first = 0, k = 0; first < cells; first += LastUses::step, k = 1 - k) {
      if (progress && !progress({"cells", static_cast<double>(first) / static_cast<double>(cells)}))
        return cancelled();
      const uint64_t next = first + LastUses::step;
      Result<> loaded;
      if (next < cells) {
        points_.plan(
            [&, next] { loaded = load(next, std::min(LastUses::step, cells - next), pieces_[1 - k]); });
      }
      MAILLE_CHECK(feed_piece(first, pieces_[k]));
      // Unless the writer asked for no point meanwhile, this was done beside its work.
      points_.read_ahead();
      MAILLE_CHECK(loaded);
    }
    MAILLE_CHECK(begin_blocks(cells));
    // Points without cells, some at a time, so that a mesh of points only needs no list of all.
    for (uint64_t next = 0;;) {
      const std::vector<uint64_t> unused = MAILLE_TRY(uses_.unused(next));
      if (unused.empty()) return {};
      MAILLE_CHECK(writer_.end_points(unused));
      next = unused.back() + 1;
    }
  }

 private:
  struct Piece {
    CellPiece cells;
    std::vector<uint8_t> flags;
    std::vector<std::vector<std::byte>> values;
  };
  Result<> load(uint64_t first, uint64_t count, Piece& piece) {
    MAILLE_CHECK(mesh_.read_cells(first, count, piece.cells));
    MAILLE_CHECK(uses_.read(first / LastUses::step, piece.cells.connectivity.size(), piece.flags));
    for (size_t k = 0; k < columns_.size(); ++k) {
      piece.values[k].resize(count * mesh_.description().arrays[columns_[k]].tuple_size());
      MAILLE_CHECK(mesh_.read_array(columns_[k], first, count, piece.values[k]));
    }
    return {};
  }
  Result<> feed_piece(uint64_t first, const Piece& piece) {
    for (uint64_t i = 0; i < piece.cells.size();) {
      MAILLE_CHECK(begin_blocks(first + i));
      i += MAILLE_TRY(feed_run(piece, first, i));
    }
    return {};
  }
  /// Begins the blocks that start at the cell, empty ones included; behind the last cell those that are left.
  Result<> begin_blocks(uint64_t cell) {
    const auto& blocks = mesh_.description().blocks;
    for (; next_block_ < blocks.size() && block_end_ <= cell; ++next_block_) {
      MAILLE_CHECK(writer_.begin_block(blocks[next_block_].name, uses_.common_types()[next_block_]));
      block_end_ += blocks[next_block_].cells;
    }
    return {};
  }
  /// Gives the writer cells of one type and size within one block; returns how many. Runs are found in the
  /// piece, so that no cell is copied.
  Result<uint64_t> feed_run(const Piece& piece, uint64_t first, uint64_t i) {
    const CellPiece& cells = piece.cells;
    const uint64_t nodes = cells.offsets[i + 1] - cells.offsets[i];
    const bool single = nodes == 0 || cells.types[i] == static_cast<uint8_t>(CellType::polyhedron);
    const uint64_t end = single ? i + 1 : std::min<uint64_t>(cells.size(), block_end_ - first);
    uint64_t next = i + 1;
    while (next < end && cells.types[next] == cells.types[i] &&
           cells.offsets[next + 1] - cells.offsets[next] == nodes) {
      ++next;
    }
    const size_t begin = cells.offsets[i], corners = (next - i) * nodes;
    for (size_t k = 0; k < columns_.size(); ++k) {
      const size_t size = mesh_.description().arrays[columns_[k]].tuple_size();
      tuples_[k] = Bytes(piece.values[k]).subspan(i * size, (next - i) * size);
    }
    const auto points = std::span(cells.connectivity).subspan(begin, corners);
    const auto flags = std::span(piece.flags).subspan(begin, corners);
    const auto type = static_cast<CellType>(cells.types[i]);
    if (type == CellType::polyhedron) {
      MAILLE_CHECK(writer_.add_polyhedron(face_sizes_of(cells, i), points, flags, tuples_));
    } else {
      MAILLE_CHECK(writer_.add_cells(type, points, flags, tuples_, nodes));
    }
    return next - i;
  }

  MeshSource& mesh_;
  PointsWithCellsAhead& points_;
  StreamWriter& writer_;
  LastUses& uses_;
  std::vector<size_t> columns_;  ///< arrays on cells
  std::array<Piece, 2> pieces_;
  std::vector<Bytes> tuples_;
  size_t next_block_ = 0;
  uint64_t block_end_ = 0;
};

// The report of a mesh in memory, from what the description knows.
EncodeReport report_of(const MeshDescription& mesh, const EncodeOptions& options, const StreamReport& stream,
                       const ArrayMapsList& maps) {
  EncodeReport report = report_of(mesh);
  report.file_bytes = stream.file_bytes;
  report.connectivity.coded_bytes = stream.cell_bytes;
  report.order_bytes = stream.number_bytes;
  report.positions.coded_bytes = stream.position_bytes;
  add_error(maps, stream, options.positions, 0, report.positions);
  for (size_t i = 0; i < mesh.arrays.size(); ++i) {
    ArrayReport& array = report.arrays[i];
    array.coded_bytes = stream.array_bytes[i];
    add_error(maps, stream, tolerance_of(options, mesh.arrays[i].name), i + 1, array);
  }
  set_other_bytes(report);
  return report;
}

/// What a point in use takes in bytes, with the cells it belongs to: entries of the hull, and the values that
/// predict. Measured: 274 bytes for hexahedra, 670 for tetrahedra, at -9 82 more; where numbers are in no
/// order, 64 for a page of them, too. Between 1 and 8 cells a point: hexahedra have about one, tetrahedra
/// five to six.
uint64_t bytes_in_use(const MeshDescription& mesh, const EncodeOptions& options) {
  const bool mixed = mixes_values(options.effort, false), bounded = mixes_values(options.effort, true);
  const uint64_t number = mixed ? 50 : 22;
  const uint64_t cells = std::clamp<uint64_t>(mesh.cells / std::max<uint64_t>(mesh.points, 1) + 1, 1, 8);
  uint64_t of_point = 176 + 3 * number, of_cell = 96;
  for (const Array& array : mesh.arrays)
    (array.domain == Domain::point ? of_point : of_cell) += 24 + number * array.components;
  // PlaneFit, with room to grow.
  for (const Array& array : mesh.arrays) {
    if (is_float(array.type) && (mixed || (bounded && options.arrays.contains(array.name))))
      of_point += 117 + 45 * array.components;
  }
  return of_point + cells * of_cell;
}

// As the functions of these names count them of a mesh in memory, so that both make the same choices.
uint64_t count_numbers(const MeshDescription& mesh) {
  uint64_t numbers = mesh.points * 3;
  for (const Array& array : mesh.arrays) numbers += mesh.count_of(array) * array.components;
  return numbers;
}

uint64_t count_bounded(const MeshDescription& mesh, const std::vector<double>& bounds) {
  uint64_t numbers = 0;
  size_t next = 0;
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::mesh) continue;
    if (bounds[++next] > 0) numbers += mesh.count_of(array) * array.components;
  }
  return numbers;
}

/// What is left for pages at least: points are read more than once or twice only where the order scatters
/// them. 1 MiB: 256 pages of the system. Chosen, no sweep is on record.
constexpr uint64_t least_for_pages = uint64_t{1} << 20;

/// What is left of the limit for pages of points. Error: memory_bound, if what is in use at once would take
/// more; that takes a pass over the cells, so it is counted only where all points together would not fit.
Result<uint64_t> memory_for_pages(MeshSource& mesh, LastUses& uses, const WorkingSpace& space,
                                  const EncodeOptions& options) {
  const uint64_t wanted = space.memory / 4;
  if (space.limit == ~uint64_t{0}) return wanted;
  const uint64_t each = bytes_in_use(mesh.description(), options);
  WorkingSpace all = space;
  all.memory = ~uint64_t{0};
  const uint64_t left = working_memory(all);
  if (mesh.description().points < left / each && left - mesh.description().points * each >= wanted)
    return wanted;
  const uint64_t points = MAILLE_TRY(uses.most_in_use(mesh, space));
  MAILLE_CHECK(
      check_limit(space, points * each + least_for_pages,
                  "in the order of its cells " + std::to_string(points) + " points are in use at once"));
  return std::min(wanted, left - points * each);
}

}  // namespace

Result<EncodeReport> encode_stream(MeshSource& given, Sink& sink, const EncodeOptions& options,
                                   const WorkingSpace& space) {
  StreamOptions stream = MAILLE_TRY(stream_options_of(given.description(), options));
  std::vector<NumberedArray> numbered;
  if (!stream.any_order) numbered = MAILLE_TRY(find_numbered(given));
  // Everything below reads zeros in the stead of numbers.
  WithoutNumbers mesh(given, numbered);
  stream.delay = space.delay;
  LastUses uses = MAILLE_TRY(LastUses::find(mesh, space, options));
  // Before anything is written: a limit that cannot be kept is told up front.
  const uint64_t for_pages = MAILLE_TRY(memory_for_pages(mesh, uses, space, options));
  const bool fast = mixing_is_fast(count_numbers(mesh.description()), mesh.description().cells, false);
  ArrayMapsList maps = MAILLE_TRY(choose_source_maps(mesh, stream, mixes_values(options.effort, fast)));
  maps.mixing_is_fast = fast;
  PointsWithCellsAhead points(mesh, for_pages);
  maps.numbered = std::move(numbered);
  set_maps_of_zeros(maps);
  maps.bounded_numbers = count_bounded(mesh.description(), maps.bounds);
  stream.points = &points;
  StreamWriter writer = MAILLE_TRY(begin_with_maps(sink, std::move(stream), maps));
  MAILLE_CHECK(SourceFeeder(mesh, points, writer, uses).feed(options.progress));
  return report_of(mesh.description(), options, MAILLE_TRY(writer.finish()), maps);
}

}  // namespace maille
