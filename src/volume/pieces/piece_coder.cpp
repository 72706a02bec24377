#include "volume/pieces/piece_coder.h"

#include <maille/version.h>

#include <algorithm>

#include "base/result.h"
#include "volume/pieces/border_points.h"
#include "volume/pieces/coarse_level.h"
#include "volume/stream/stream_file.h"

namespace maille {
namespace {

/// Positions as a decoder has them, by decoding the piece: points of different places may have one place on a
/// lattice, and decoders know shared points by their place.
Result<Array> decoded_points(Bytes file, std::vector<Place>& places) {
  DecodeOptions options;
  options.arrays.emplace();
  Mesh decoded = MAILLE_TRY(decode_stream(*memory_source(file), options));
  for (uint32_t i = 0; i < decoded.point_count(); ++i) places.push_back(place_of(decoded.points, i));
  return std::move(decoded.points);
}

/// Of array i; 0: positions. Maps by logarithm have bounds relative to each number.
PieceBound bound_of(const ArrayMapsList& maps, size_t i) {
  const bool by_size = !maps.maps[i].empty() && maps.maps[i][0].kind == NumberMap::Kind::logarithm;
  return {maps.bounds[i], by_size};
}

// What the index says of a piece before it is coded.
void describe(const ArrayMapsList& maps, const Mesh& sub, PieceRecord& record) {
  record.cells = sub.cell_count();
  record.points = sub.point_count();
  enclose(sub.points, bound_of(maps, 0), record);
  for (size_t i = 0; i < sub.arrays.size(); ++i)
    record.fields.push_back(describe_field(sub.arrays[i], bound_of(maps, i + 1)));
}

/// Sets arrays of numbers to 0: their values follow from the numbers of points and cells, which stand apart.
void blank_numbers(const std::vector<NumberedArray>& numbered, Mesh& sub) {
  for (const NumberedArray& array : numbered) {
    Buffer<std::byte>& bytes = sub.arrays[array.array].bytes;
    std::fill(bytes.begin(), bytes.end(), std::byte{0});
  }
}

// Bytes add up; how an array is coded is the same in all pieces.
void add(const ArrayReport& piece, ArrayReport& all) {
  all.coded_bytes += piece.coded_bytes;
  all.lossless = piece.lossless;
  all.bound = piece.bound;
  all.asked = piece.asked;
  all.extent = piece.extent;
  all.step = piece.step;
  all.maximum_error = std::max(all.maximum_error, piece.maximum_error);
}

}  // namespace

/// (find_numbered() also finds arrays of several runs.)
void set_numbered(const std::vector<NumberedArray>& found, ArrayMapsList& maps) {
  maps.numbered.clear();
  for (const NumberedArray& array : found) {
    if (array.runs.size() == 1) maps.numbered.push_back(array);
  }
  set_maps_of_zeros(maps);
}

// Pieces stand in another order than the input's: the file says "any order", and "order apart" if GIDS give
// it back.
StreamHeader header_of(const PieceCoding& coding) {
  StreamHeader header;
  header.description.positions = coding.stream.positions;
  header.description.arrays = coding.stream.arrays;
  header.description.mesh_arrays = coding.stream.mesh_arrays;
  header.description.metadata = coding.stream.metadata;
  header.description.provenance = coding.stream.provenance;
  header.description.effort = coding.stream.effort;
  header.description.time = coding.stream.time;
  header.description.numbered = coding.maps.numbered;
  header.description.any_order = true;
  header.description.order_apart = coding.kept();
  header.maps = coding.maps.maps;
  header.bounds = coding.maps.bounds;
  return header;
}

Result<PieceInWork> code_piece(const PieceCoding& coding, SubMesh sub, std::vector<uint32_t> cells) {
  EncodeOptions options = coding.options;
  options.executor = nullptr;
  options.progress = nullptr;
  StreamOptions stream = coding.stream;
  stream.executor = nullptr;
  // All that the whole file says once is left out of its pieces.
  stream.mesh_arrays.clear();
  stream.metadata.clear();
  stream.provenance.clear();
  stream.time.reset();
  PieceInWork piece;
  // Before numbers become zeros: the index speaks of the true values.
  describe(coding.maps, sub.mesh, piece.record);
  add_coarse_points(sub.mesh, cells_of_coarse_point(coding.cells), piece.record);
  blank_numbers(coding.maps.numbered, sub.mesh);
  std::vector<uint32_t> order;
  const auto sink = memory_sink(piece.coded.file);
  piece.report =
      MAILLE_TRY(encode_stream_by(sub.mesh, *sink, options, std::move(stream), coding.maps, &order));
  std::vector<uint32_t> place_of_point(order.size());
  for (uint32_t i = 0; i < order.size(); ++i) {
    place_of_point[order[i]] = i;
    piece.coded_points.push_back(sub.points[order[i]]);
  }
  // Points without cells have no border: nothing joins them to other pieces.
  if (!cells.empty()) piece.border = border_points(sub.mesh, place_of_point);
  if (coding.maps.bounds[0] > 0) {
    const Array decoded = MAILLE_TRY(decoded_points(piece.coded.file, piece.places));
    piece.on_side = on_sides(decoded, piece.border);
  } else {
    std::vector<uint32_t> border = piece.border;
    for (uint32_t& point : border) point = order[point];
    piece.on_side = on_sides(sub.mesh.points, border);
  }
  const EncodeReport& report = piece.report;
  piece.record.coded_bytes = {report.connectivity.coded_bytes, report.order_bytes,
                              report.positions.coded_bytes};
  for (const ArrayReport& array : report.arrays) piece.record.coded_bytes.push_back(array.coded_bytes);
  piece.coded.blocks = std::move(sub.block_numbers);
  if (!coding.kept()) return piece;
  piece.numbers.points = std::move(sub.points);
  if (cells.empty()) return piece;
  piece.record.first_cell = cells.front();
  piece.record.last_cell = cells.back();
  piece.numbers.cells = std::move(cells);
  return piece;
}

void add_report(const EncodeReport& piece, EncodeReport& all) {
  all.connectivity.coded_bytes += piece.connectivity.coded_bytes;
  all.order_bytes += piece.order_bytes;
  add(piece.positions, all.positions);
  size_t next = 0;
  for (ArrayReport& array : all.arrays) {
    if (array.domain != Domain::mesh) add(piece.arrays[next++], array);
  }
}

Result<FileWriter> begin_file(Sink& sink, const PieceCoding& coding) {
  const FileHeader header = {.major = format_major,
                             .minor = format_minor,
                             .required_features = in_pieces_feature,
                             .mode = Mode::stream};
  FileWriter file = MAILLE_TRY(FileWriter::begin(sink, header));
  MAILLE_CHECK(file.write_stream({"DESC"}, MAILLE_TRY(encode_header(header_of(coding)))));
  return file;
}

// A page of 4,096 lines can be read and checked by itself.
Result<> write_index(FileWriter& file, const std::vector<PieceRecord>& records) {
  for (size_t first = 0; first < records.size(); first += pieces_per_page) {
    const auto count = static_cast<ptrdiff_t>(std::min<size_t>(pieces_per_page, records.size() - first));
    const auto from = records.begin() + static_cast<ptrdiff_t>(first);
    const auto page = static_cast<uint32_t>(first / pieces_per_page);
    MAILLE_CHECK(file.write_stream({"PIDX", page, 0}, encode_index({from, from + count})));
  }
  return {};
}

CellTotals count_cells(const Mesh& mesh) {
  CellTotals totals;
  totals.corners = mesh.corner_count();
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      ++totals.of_type[static_cast<size_t>(block.type_of(i))];
      /// Each cell's type, and for polyhedra what their faces take.
      if (block.type_of(i) != CellType::polyhedron) continue;
      const auto corners = block.cell(i);
      std::vector<uint64_t> points(corners.begin(), corners.end());
      count_polyhedron(points, block.faces(i).size(), totals.polyhedra);
    }
  }
  return totals;
}

void add_totals(const CellTotals& some, CellTotals& all) {
  for (size_t type = 0; type < all.of_type.size(); ++type) all.of_type[type] += some.of_type[type];
  all.corners += some.corners;
  all.polyhedra.cells += some.polyhedra.cells;
  all.polyhedra.faces += some.polyhedra.faces;
  all.polyhedra.corners += some.polyhedra.corners;
  all.polyhedra.points += some.polyhedra.points;
}

void set_totals(const CellTotals& totals, StreamTail& tail) {
  tail.corners = totals.corners;
  tail.polyhedra = totals.polyhedra;
  for (size_t type = 0; type < totals.of_type.size(); ++type) {
    if (totals.of_type[type] > 0) tail.types.emplace_back(static_cast<CellType>(type), totals.of_type[type]);
  }
}

/// -0.0 + 0.0 is 0.0, and all else stays.
void unsign_zeros(StreamTail& tail) {
  for (ValueRange& range : tail.ranges) {
    for (ValueRange::Component& component : range.components) {
      component.low += 0.0;
      component.high += 0.0;
    }
  }
}

// As TAIL has them: positions first, arrays of the mesh left out.
std::vector<double> errors_of(const EncodeReport& report) {
  std::vector<double> errors = {report.positions.maximum_error};
  bool exact = report.positions.lossless;
  for (const ArrayReport& array : report.arrays) {
    if (array.domain == Domain::mesh) continue;
    errors.push_back(array.maximum_error);
    exact = exact && array.lossless;
  }
  if (exact) errors.clear();
  return errors;
}

}  // namespace maille
