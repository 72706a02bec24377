#include <maille/stream.h>
#include <maille/version.h>

#include <algorithm>
#include <cmath>

#include "base/pace.h"
#include "base/result.h"
#include "container/file_writer.h"
#include "surface/arrays/array_report.h"
#include "surface/parts/shared_points.h"
#include "volume/pieces/border_points.h"
#include "volume/pieces/cut_cells.h"
#include "volume/pieces/pieces_file.h"
#include "volume/pieces/sub_mesh.h"
#include "volume/stream/mesh_stream.h"

namespace maille {
namespace {

/// A piece between its own coding and that of what joins it to others.
struct PieceInWork {
  CodedPiece coded;
  PieceRecord record;
  PieceNumbers numbers;                ///< of an order that is kept
  std::vector<uint32_t> coded_points;  ///< numbers in the mesh, in the coded order
  std::vector<uint32_t> border;        ///< points in the coded order
  std::vector<Place> places;           ///< by coded point, where positions are not exact
  EncodeReport report;
};

/// Points that no cell uses are a piece, too.
std::vector<uint32_t> unused_points(const Mesh& mesh) {
  std::vector<bool> used(mesh.point_count());
  for (const CellBlock& block : mesh.blocks) {
    for (const uint32_t point : block.connectivity) used[point] = true;
  }
  std::vector<uint32_t> unused;
  for (uint32_t point = 0; point < used.size(); ++point) {
    if (!used[point]) unused.push_back(point);
  }
  return unused;
}

class PiecesEncoder {
 public:
  PiecesEncoder(const Mesh& mesh, const EncodeOptions& options, StreamOptions stream, ArrayMapsList maps)
      : mesh_(mesh),
        options_(options),
        stream_(std::move(stream)),
        maps_(std::move(maps)),
        executor_(options.executor ? *options.executor : serial_executor()),
        kept_(options.order == Order::keep) {}

  Result<EncodeReport> run(Sink& sink, uint64_t target) {
    cells_ = cut_cells(mesh_, target, executor_);
    unused_ = unused_points(mesh_);
    pieces_.resize(cells_.size() + (unused_.empty() ? 0 : 1));
    MAILLE_CHECK(code_all());
    join();
    return write(sink);
  }

 private:
  /// Some pieces at once, so that their number does not depend on threads, and progress is told by one.
  static constexpr size_t at_once = 32;

  Result<> code_all() {
    for (size_t first = 0; first < pieces_.size(); first += at_once) {
      const size_t count = std::min(at_once, pieces_.size() - first);
      std::vector<Result<>> done(count);
      executor_.parallel_for(count, [&](size_t i) { done[i] = code(first + i); });
      for (const Result<>& each : done) MAILLE_CHECK(each);
      const double share = static_cast<double>(first + count) / static_cast<double>(pieces_.size());
      if (options_.progress && !options_.progress({"cells", share})) return cancelled();
    }
    return {};
  }

  Result<> code(size_t number) {
    PieceInWork& piece = pieces_[number];
    const bool has_cells = number < cells_.size();
    SubMesh sub = has_cells ? take_cells(mesh_, cells_[number]) : take_points(mesh_, unused_);
    EncodeOptions options = options_;
    options.executor = nullptr;
    options.progress = nullptr;
    StreamOptions stream = stream_;
    stream.executor = nullptr;
    stream.mesh_arrays.clear();
    stream.metadata.clear();
    stream.provenance.clear();
    std::vector<uint32_t> order;
    const auto sink = memory_sink(piece.coded.file);
    piece.report = MAILLE_TRY(encode_stream_by(sub.mesh, *sink, options, std::move(stream), maps_, &order));
    std::vector<uint32_t> place_of_point(order.size());
    for (uint32_t i = 0; i < order.size(); ++i) {
      place_of_point[order[i]] = i;
      piece.coded_points.push_back(sub.points[order[i]]);
    }
    if (has_cells) piece.border = border_points(sub.mesh, place_of_point);
    if (maps_.bounds[0] > 0) MAILLE_CHECK(find_places(piece));
    describe(sub.mesh, piece);
    piece.coded.blocks = std::move(sub.block_numbers);
    if (!kept_) return {};
    piece.numbers.points = std::move(sub.points);
    if (!has_cells) return {};
    piece.numbers.cells = cells_[number];
    piece.record.first_cell = cells_[number].front();
    piece.record.last_cell = cells_[number].back();
    return {};
  }

  /// Points of different places may have one place on a lattice: decoders know them apart by that.
  Result<> find_places(PieceInWork& piece) const {
    DecodeOptions options;
    options.arrays.emplace();
    const Mesh decoded = MAILLE_TRY(decode_stream(*memory_source(Bytes(piece.coded.file)), options));
    for (uint32_t i = 0; i < decoded.point_count(); ++i) piece.places.push_back(place_of(decoded.points, i));
    return {};
  }

  /// How far numbers of array i (0: positions) may be from what is described.
  double bound_of(size_t i, const PieceField& field) const {
    const bool by_size = !maps_.maps[i].empty() && maps_.maps[i][0].kind == NumberMap::Kind::logarithm;
    if (!by_size) return maps_.bounds[i];
    double largest = 0;
    for (const PieceField::Component& component : field.components) {
      if (component.low <= component.high)
        largest = std::max<double>({largest, std::abs(component.low), std::abs(component.high)});
    }
    return maps_.bounds[i] * largest;
  }

  void describe(const Mesh& sub, PieceInWork& piece) const {
    PieceRecord& record = piece.record;
    record.cells = sub.cell_count();
    record.points = sub.point_count();
    enclose(sub.points, bound_of(0, describe_field(sub.points, 0)), record);
    const EncodeReport& report = piece.report;
    record.coded_bytes = {report.connectivity.coded_bytes, report.order_bytes, report.positions.coded_bytes};
    size_t next = 1;
    for (const Array& array : sub.arrays) {
      record.fields.push_back(describe_field(array, 0));
      const double bound = bound_of(next, record.fields.back());
      if (bound > 0) record.fields.back() = describe_field(array, bound);
      record.coded_bytes.push_back(report.arrays[next++ - 1].coded_bytes);
    }
  }

  void join() {
    std::vector<std::span<const uint32_t>> points;
    for (const PieceInWork& piece : pieces_) points.emplace_back(piece.coded_points);
    std::vector<Place> places;
    if (maps_.bounds[0] > 0) places.resize(mesh_.point_count());
    for (PieceInWork& piece : pieces_) {
      for (size_t i = 0; i < piece.places.size(); ++i) places[piece.coded_points[i]] = piece.places[i];
      piece.places = {};
    }
    const auto shared = find_shared(points, static_cast<uint32_t>(mesh_.point_count()), [&](uint32_t point) {
      return places.empty() ? place_of(mesh_.points, point) : places[point];
    });
    executor_.parallel_for(pieces_.size(), [&](size_t p) {
      PieceInWork& piece = pieces_[p];
      const auto count = static_cast<uint32_t>(piece.coded_points.size());
      piece.coded.shared = encode_shared(shared[p], count, piece.border);
    });
  }

  StreamHeader header() const {
    StreamHeader header;
    header.description.positions = stream_.positions;
    header.description.arrays = stream_.arrays;
    header.description.mesh_arrays = stream_.mesh_arrays;
    header.description.metadata = stream_.metadata;
    header.description.provenance = stream_.provenance;
    header.description.effort = stream_.effort;
    header.description.any_order = true;
    header.description.order_apart = kept_;
    header.maps = maps_.maps;
    header.bounds = maps_.bounds;
    return header;
  }

  StreamTail tail(const EncodeReport& report) const {
    StreamTail tail;
    tail.points = mesh_.point_count();
    tail.cells = mesh_.cell_count();
    tail.corners = mesh_.corner_count();
    tail.batches = pieces_.size();
    std::array<uint64_t, 256> of_type{};
    for (const CellBlock& block : mesh_.blocks) {
      tail.blocks.push_back({block.name, block.type, block.size()});
      for (uint64_t i = 0; i < block.size(); ++i) {
        ++of_type[static_cast<size_t>(block.type_of(i))];
        if (block.type_of(i) != CellType::polyhedron) continue;
        const auto corners = block.cell(i);
        std::vector<uint64_t> points(corners.begin(), corners.end());
        count_polyhedron(points, block.faces(i).size(), tail.polyhedra);
      }
    }
    for (size_t type = 0; type < of_type.size(); ++type) {
      if (of_type[type] > 0) tail.types.emplace_back(static_cast<CellType>(type), of_type[type]);
    }
    widen(tail.ranges.emplace_back(), mesh_.points.type, 3, mesh_.points.bytes);
    bool exact = maps_.bounds[0] == 0;
    tail.errors.push_back(report.positions.maximum_error);
    for (size_t i = 0; i < mesh_.arrays.size(); ++i) {
      const Array& array = mesh_.arrays[i];
      if (array.domain == Domain::mesh) continue;
      widen(tail.ranges.emplace_back(), array.type, array.components, array.bytes);
      tail.errors.push_back(report.arrays[i].maximum_error);
      exact = exact && report.arrays[i].lossless;
    }
    if (exact) tail.errors.clear();
    return tail;
  }

  /// What the pieces say of themselves, together.
  EncodeReport sum() const {
    EncodeReport report = report_of(mesh_);
    report.positions = report_of(mesh_.points);
    std::vector<ArrayReport*> fields;
    for (const Array& array : mesh_.arrays) report.arrays.push_back(report_of(array));
    for (ArrayReport& array : report.arrays) {
      if (array.domain != Domain::mesh) fields.push_back(&array);
    }
    for (const PieceInWork& piece : pieces_) {
      report.connectivity.coded_bytes += piece.report.connectivity.coded_bytes;
      report.order_bytes += piece.report.order_bytes;
      add(piece.report.positions, report.positions);
      for (size_t i = 0; i < fields.size(); ++i) add(piece.report.arrays[i], *fields[i]);
    }
    return report;
  }
  static void add(const ArrayReport& piece, ArrayReport& all) {
    all.coded_bytes += piece.coded_bytes;
    all.lossless = piece.lossless;
    all.bound = piece.bound;
    all.asked = piece.asked;
    all.extent = piece.extent;
    all.step = piece.step;
    all.maximum_error = std::max(all.maximum_error, piece.maximum_error);
  }

  Result<EncodeReport> write(Sink& sink) {
    EncodeReport report = sum();
    const FileHeader file_header = {.major = format_major,
                                    .minor = format_minor,
                                    .required_features = in_pieces_feature,
                                    .mode = Mode::stream};
    FileWriter file = MAILLE_TRY(FileWriter::begin(sink, file_header));
    MAILLE_CHECK(file.write_stream({"DESC"}, MAILLE_TRY(encode_header(header()))));
    for (uint32_t p = 0; p < pieces_.size(); ++p) {
      MAILLE_CHECK(file.write_stream({"PIEC", p, 0}, encode_piece(pieces_[p].coded)));
      pieces_[p].coded = {};
    }
    for (uint32_t p = 0; p < pieces_.size() && kept_; ++p) {
      const std::vector<std::byte> numbers = encode_numbers(pieces_[p].numbers);
      report.order_bytes += numbers.size();
      MAILLE_CHECK(file.write_stream({"GIDS", p, 0}, numbers));
    }
    std::vector<PieceRecord> page;
    for (uint32_t p = 0; p < pieces_.size(); ++p) {
      page.push_back(std::move(pieces_[p].record));
      if (page.size() < pieces_per_page && p + 1 < pieces_.size()) continue;
      MAILLE_CHECK(file.write_stream({"PIDX", p / pieces_per_page, 0}, encode_index(page)));
      page.clear();
    }
    MAILLE_CHECK(file.write_stream({"TAIL"}, encode_tail(tail(report))));
    report.file_bytes = MAILLE_TRY(file.finish());
    MAILLE_CHECK(sink.commit());
    report.other_bytes = report.file_bytes - report.connectivity.coded_bytes - report.order_bytes -
                         report.positions.coded_bytes;
    for (const ArrayReport& array : report.arrays) report.other_bytes -= array.coded_bytes;
    return report;
  }

  const Mesh& mesh_;
  const EncodeOptions& options_;
  StreamOptions stream_;
  ArrayMapsList maps_;
  Executor& executor_;
  bool kept_;
  std::vector<std::vector<uint32_t>> cells_;  ///< by piece
  std::vector<uint32_t> unused_;
  std::vector<PieceInWork> pieces_;
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
  return PiecesEncoder(mesh, options, std::move(stream), std::move(maps)).run(sink, target);
}

}  // namespace maille
