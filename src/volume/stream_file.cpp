#include "volume/stream_file.h"

#include <maille/stream.h>

#include <algorithm>

#include "base/pace.h"
#include "base/result.h"
#include "container/file_reader.h"
#include "surface/array_report.h"
#include "volume/cell_order.h"
#include "volume/mesh_stream.h"
#include "volume/stream_layout.h"

namespace maille {
namespace {

constexpr std::string_view known_types[] = {"DESC", "CELL", "POSI", "ARRY", "TAIL"};

/// Points of a mesh in memory, as the writer wants them.
class MeshPoints final : public PointSource {
 public:
  explicit MeshPoints(const Mesh& mesh) {
    add(mesh.points);
    for (const Array& array : mesh.arrays) {
      if (array.domain == Domain::point) add(array);
    }
  }
  Result<> read(uint64_t number, std::byte* out) override {
    for (const auto& [bytes, size] : columns_) out = std::copy_n(bytes + number * size, size, out);
    return {};
  }

 private:
  void add(const Array& array) { columns_.emplace_back(array.bytes.data(), array.tuple_size()); }
  std::vector<std::pair<const std::byte*, size_t>> columns_;
};

StreamArray describe(const Array& array, const Tolerance& tolerance) {
  return {array.name, array.domain, array.type, array.components, array.role, array.labels, tolerance, {}};
}

Result<StreamOptions> options_for(const Mesh& mesh, const EncodeOptions& options) {
  StreamOptions stream;
  stream.positions = describe(mesh.points, options.positions);
  for (const Array& array : mesh.arrays) {
    const auto found = options.arrays.find(array.name);
    const Tolerance tolerance = found == options.arrays.end() ? Tolerance{} : found->second;
    if (array.domain == Domain::mesh) {
      stream.mesh_arrays.push_back(array);
    } else {
      stream.arrays.push_back(describe(array, tolerance));
    }
  }
  for (const auto& [name, tolerance] : options.arrays) {
    const auto same_name = [&name = name](const Array& array) { return array.name == name; };
    if (std::none_of(mesh.arrays.begin(), mesh.arrays.end(), same_name)) {
      return failure(ErrorCode::usage, "the mesh has no array named \"" + name + "\"");
    }
  }
  stream.metadata = mesh.metadata;
  stream.provenance = options.provenance;
  stream.effort = options.effort;
  stream.any_order = options.order == Order::canonical;
  stream.executor = options.executor;
  return stream;
}

/// By block, the order in which its cells are written; none: as they are.
using CellOrders = std::vector<std::vector<uint64_t>>;

/// When each point is used last, counted in cells as written; none for points that no cell uses.
std::vector<uint64_t> last_cells(const Mesh& mesh, const CellOrders& orders) {
  std::vector<uint64_t> last(mesh.point_count(), ~uint64_t{0});
  uint64_t time = 0;
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    const CellBlock& block = mesh.blocks[b];
    for (uint64_t i = 0; i < block.size(); ++i, ++time) {
      for (const uint32_t point : block.cell(orders[b].empty() ? i : orders[b][i])) last[point] = time;
    }
  }
  return last;
}

/// What the connectivity of the first cells takes in these orders, in bytes.
size_t trial(const Mesh& mesh, const CellOrders& orders, const std::vector<uint64_t>& last, bool mixed,
             uint64_t most_cells) {
  RangeEncoder topology, numbers;
  CellCoder<RangeEncoder> coder(mixed, false);
  CodedCells out;
  StreamedCell cell;
  uint64_t time = 0;
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    const CellBlock& block = mesh.blocks[b];
    for (uint64_t i = 0; i < block.size() && time < most_cells; ++i, ++time) {
      const uint64_t number = orders[b].empty() ? i : orders[b][i];
      cell.kind =
          kind_of(block.type == CellType::mixed ? static_cast<CellType>(block.types[number]) : block.type);
      if (cell.kind == loose_cell) continue;
      const auto points = block.cell(number);
      cell.final = 0;
      for (size_t k = 0; k < points.size(); ++k) {
        cell.number[k] = points[cell_shapes[cell.kind].place[k]];
        cell.final |= (last[cell.number[k]] == time ? 1u : 0u) << k;
      }
      coder.code(topology, numbers, cell, out);
      if (out.size() < cells_per_block) continue;
      out.clear();
      coder.end_block();
    }
  }
  return topology.finish().size();
}

/// Where any order will do: as they are, if that is a good order, else as the front meets them.
CellOrders choose_orders(const Mesh& mesh, const EncodeOptions& options) {
  CellOrders as_they_are(mesh.blocks.size());
  if (options.order == Order::keep) return as_they_are;
  const bool mixed = mixes(options.effort);
  CellOrders by_front;
  for (const CellBlock& block : mesh.blocks) by_front.push_back(front_order(block));
  const std::vector<uint64_t> last = last_cells(mesh, as_they_are),
                              last_by_front = last_cells(mesh, by_front);
  // Some thousand cells mostly decide: cells in no order at all take long to try.
  for (const uint64_t cells : {uint64_t{20'000}, uint64_t{400'000}}) {
    const size_t natural = trial(mesh, as_they_are, last, mixed, cells);
    const size_t front = trial(mesh, by_front, last_by_front, mixed, cells);
    if (cells == 400'000 || natural > 2 * front || front > 2 * natural)
      return front < natural ? by_front : as_they_are;
  }
  return as_they_are;
}

/// Hands the cells of a mesh to a writer, one by one.
class MeshFeeder {
 public:
  MeshFeeder(const Mesh& mesh, StreamWriter& writer, const EncodeOptions& options)
      : mesh_(mesh),
        writer_(writer),
        orders_(choose_orders(mesh, options)),
        last_(last_cells(mesh, orders_)),
        pace_(options.progress, "cells", mesh.cell_count()) {
    for (const Array& array : mesh.arrays) {
      if (array.domain == Domain::cell) columns_.push_back(&array);
    }
    arrays_.resize(columns_.size());
  }
  Result<> feed() {
    for (size_t b = 0; b < mesh_.blocks.size(); ++b) {
      const CellBlock& block = mesh_.blocks[b];
      MAILLE_CHECK(writer_.begin_block(block.name, block.type));
      for (uint64_t i = 0; i < block.size();) i += MAILLE_TRY(feed_run(block, orders_[b], i));
      first_ += block.size();
    }
    std::vector<uint64_t> unused;
    for (uint64_t point = 0; point < last_.size(); ++point) {
      if (last_[point] == ~uint64_t{0}) unused.push_back(point);
    }
    return writer_.end_points(unused);
  }

 private:
  /// Some hundred cells of one type and size; returns how many.
  Result<uint64_t> feed_run(const CellBlock& block, const std::vector<uint64_t>& order, uint64_t first) {
    const auto cell_at = [&](uint64_t i) { return order.empty() ? i : order[i]; };
    const auto type_of = [&](uint64_t i) {
      return block.type == CellType::mixed ? static_cast<CellType>(block.types[cell_at(i)]) : block.type;
    };
    const size_t nodes = block.cell(cell_at(first)).size();
    const uint64_t most = nodes == 0 ? 1 : std::min<uint64_t>(512, block.size() - first);
    numbers_.clear();
    finals_.clear();
    for (auto& bytes : arrays_) bytes.clear();
    uint64_t count = 0;
    for (; count < most && type_of(first + count) == type_of(first); ++count) {
      const uint64_t cell = cell_at(first + count);
      if (block.cell(cell).size() != nodes) break;
      for (const uint32_t point : block.cell(cell)) {
        numbers_.push_back(point);
        finals_.push_back(last_[point] == first_ + first + count);
      }
      for (size_t k = 0; k < columns_.size(); ++k) {
        const size_t size = columns_[k]->tuple_size();
        const auto from = columns_[k]->bytes.begin() + static_cast<ptrdiff_t>((first_ + cell) * size);
        arrays_[k].insert(arrays_[k].end(), from, from + static_cast<ptrdiff_t>(size));
      }
      if (!pace_.step()) return cancelled();
    }
    const std::vector<Bytes> arrays(arrays_.begin(), arrays_.end());
    MAILLE_CHECK(writer_.add_cells(type_of(first), numbers_, finals_, arrays, nodes));
    return count;
  }

  const Mesh& mesh_;
  StreamWriter& writer_;
  CellOrders orders_;
  std::vector<uint64_t> last_;
  Pace pace_;
  std::vector<const Array*> columns_;
  uint64_t first_ = 0;  ///< cells of the blocks before
  std::vector<uint64_t> numbers_;
  std::vector<uint8_t> finals_;
  std::vector<std::vector<std::byte>> arrays_;
};

ArrayReport report_of(const Array& array, const std::vector<NumberMap>& maps, double bound,
                      uint64_t coded_bytes) {
  ArrayReport report = report_of(array);
  report.coded_bytes = coded_bytes;
  report.lossless = bound == 0;
  report.bound = bound;
  if (!maps.empty() && bound > 0) report.step = maps[0].step;
  return report;
}

EncodeReport report_of(const Mesh& mesh, const StreamReport& stream, const ArrayMapsList& maps) {
  EncodeReport report = report_of(mesh);
  report.file_bytes = stream.file_bytes;
  report.connectivity.coded_bytes = stream.cell_bytes;
  report.order_bytes = stream.number_bytes;
  report.positions = report_of(mesh.points, maps.maps[0], maps.bounds[0], stream.position_bytes);
  report.other_bytes = stream.file_bytes - stream.cell_bytes - stream.number_bytes - stream.position_bytes;
  size_t next = 0;
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::mesh) {
      report.arrays.push_back(report_of(array, {}, 0, 0));
      continue;
    }
    report.arrays.push_back(
        report_of(array, maps.maps[next + 1], maps.bounds[next + 1], stream.array_bytes[next]));
    report.other_bytes -= stream.array_bytes[next++];
  }
  return report;
}

}  // namespace

Result<EncodeReport> encode_stream(const Mesh& mesh, Sink& sink, const EncodeOptions& options) {
  MAILLE_CHECK(validate(mesh));
  StreamOptions stream_options = MAILLE_TRY(options_for(mesh, options));
  MeshPoints points(mesh);
  stream_options.points = &points;
  const ArrayMapsList maps = MAILLE_TRY(choose_stream_maps(mesh, stream_options));
  StreamWriter writer = MAILLE_TRY(begin_with_maps(sink, std::move(stream_options), maps));
  MAILLE_CHECK(MeshFeeder(mesh, writer, options).feed());
  return report_of(mesh, MAILLE_TRY(writer.finish()), maps);
}

namespace {

/// Puts pieces together again. Points come in the order of their first use, and go to the places of their
/// numbers in the end: nothing is reserved for a number that a file claims.
class MeshCollector {
 public:
  MeshCollector(const StreamDescription& description, const DecodeOptions& options) : options_(options) {
    mesh_.points = make(description.positions);
    for (const StreamArray& array : description.arrays) {
      const bool wanted = !options.arrays || std::find(options.arrays->begin(), options.arrays->end(),
                                                       array.name) != options.arrays->end();
      wanted_.push_back(wanted);
      arrays_.push_back(make(array));
    }
    for (const Array& array : description.mesh_arrays) mesh_arrays_.push_back(array);
    mesh_.metadata = description.metadata;
  }

  Result<> add(const StreamPiece& piece, const std::string& name) {
    size_t next_block = 0;
    for (size_t i = 0; i <= piece.cell_count(); ++i) {
      while (next_block < piece.blocks.size() &&
             piece.blocks[next_block].first_cell <= piece.first_cell + i) {
        begin_block(piece.blocks[next_block++]);
      }
      if (i == piece.cell_count()) break;
      if (mesh_.blocks.empty()) begin_block({});
      MAILLE_CHECK(add_cell(piece, i, name));
    }
    numbers_.insert(numbers_.end(), piece.points.begin(), piece.points.end());
    append(mesh_.points, piece.positions);
    size_t of_points = 0, of_cells = 0;
    for (size_t k = 0; k < arrays_.size(); ++k) {
      const bool points = arrays_[k].domain == Domain::point;
      const auto& bytes = points ? piece.point_arrays[of_points++] : piece.cell_arrays[of_cells++];
      if (wanted_[k]) append(arrays_[k], bytes);
    }
    if (size_ > options_.limits.mesh_bytes) {
      return failure(ErrorCode::memory_bound, name + ": the mesh takes more than the " +
                                                  std::to_string(options_.limits.mesh_bytes >> 20) +
                                                  " MiB allowed");
    }
    return {};
  }

  Result<Mesh> finish(const std::string& name) {
    MAILLE_CHECK(put_in_place(name));
    for (size_t k = 0; k < arrays_.size(); ++k) {
      if (wanted_[k]) mesh_.arrays.push_back(std::move(arrays_[k]));
    }
    for (Array& array : mesh_arrays_) mesh_.arrays.push_back(std::move(array));
    if (auto valid = validate(mesh_); !valid) {
      return failure(ErrorCode::corrupt, name + ": " + std::move(valid).error().message);
    }
    return std::move(mesh_);
  }

 private:
  static Array make(const StreamArray& described) {
    Array array =
        make_array(described.name, described.domain, described.type, described.components, described.role);
    array.labels = described.labels;
    return array;
  }
  void append(Array& array, const std::vector<std::byte>& bytes) {
    array.bytes.insert(array.bytes.end(), bytes.begin(), bytes.end());
    size_ += bytes.size();
  }
  void begin_block(const StreamPiece::Block& start) {
    CellBlock& block = mesh_.blocks.emplace_back();
    block.name = start.name;
    block.type = start.type;
  }
  Result<> add_cell(const StreamPiece& piece, size_t i, const std::string& name) {
    CellBlock& block = mesh_.blocks.back();
    if (nodes_of(block.type) == 0 && block.offsets.empty()) block.offsets.push_back(0);
    for (uint64_t k = piece.offsets[i]; k < piece.offsets[i + 1]; ++k) {
      if (piece.connectivity[k] > max_points) {
        return failure(ErrorCode::memory_bound,
                       name + ": more points than a mesh in memory can have; read it in pieces");
      }
      block.connectivity.push_back(static_cast<uint32_t>(piece.connectivity[k]));
    }
    if (nodes_of(block.type) == 0) block.offsets.push_back(block.connectivity.size());
    if (block.type == CellType::mixed) block.types.push_back(static_cast<uint8_t>(piece.types[i]));
    size_ += (piece.offsets[i + 1] - piece.offsets[i]) * 4 + (nodes_of(block.type) == 0 ? 9 : 0);
    return {};
  }
  /// Numbers of points must be 0 to n - 1, each once.
  Result<> put_in_place(const std::string& name) {
    std::vector<bool> seen(numbers_.size());
    bool in_order = true;
    for (size_t i = 0; i < numbers_.size(); ++i) {
      if (numbers_[i] >= seen.size() || seen[numbers_[i]]) {
        return failure(ErrorCode::corrupt,
                       name + ": the numbers of points have gaps or repeat; read it in pieces");
      }
      seen[numbers_[i]] = true;
      in_order = in_order && numbers_[i] == i;
    }
    if (in_order) return {};
    put_in_place(mesh_.points);
    for (size_t k = 0; k < arrays_.size(); ++k) {
      if (wanted_[k] && arrays_[k].domain == Domain::point) put_in_place(arrays_[k]);
    }
    return {};
  }
  void put_in_place(Array& array) const {
    const size_t size = array.tuple_size();
    std::vector<std::byte> bytes(array.bytes.size());
    for (size_t i = 0; i < numbers_.size(); ++i) {
      std::copy_n(array.bytes.data() + i * size, size, bytes.data() + numbers_[i] * size);
    }
    array.bytes = std::move(bytes);
  }

  const DecodeOptions& options_;
  Mesh mesh_;
  std::vector<Array> arrays_, mesh_arrays_;
  std::vector<bool> wanted_;
  std::vector<uint64_t> numbers_;
  uint64_t size_ = 0;
};

}  // namespace

Result<Mesh> decode_stream(const Source& source, const DecodeOptions& options) {
  StreamReader reader = MAILLE_TRY(
      StreamReader::open(source_stream(source), {.limits = options.limits, .executor = options.executor}));
  MeshCollector collector(reader.description(), options);
  StreamPiece piece;
  while (MAILLE_TRY(reader.next(piece))) {
    MAILLE_CHECK(collector.add(piece, source.name()));
    if (options.progress && !options.progress({"cells", 0})) return cancelled();
  }
  return collector.finish(source.name());
}

namespace {

ArrayInfo info_of(const StreamArray& array, double bound, const NumberMap& map, uint64_t count) {
  ArrayInfo info;
  info.name = array.name;
  info.domain = array.domain;
  info.type = array.type;
  info.components = array.components;
  info.role = array.role;
  info.count = count;
  info.lossless = bound == 0;
  info.asked = array.tolerance;
  info.bound = bound;
  info.step = bound > 0 ? map.step : 0;
  return info;
}

void add_sizes(const FileReader& reader, FileInfo& info) {
  for (const ChunkRecord& record : reader.records()) {
    const std::string_view type(record.header.type.data(), record.header.type.size());
    if (type == "CELL") info.connectivity.coded_bytes += record.header.size;
    if (type == "POSI") info.positions.coded_bytes += record.header.size;
    if (type == "ARRY" && record.header.number < info.arrays.size()) {
      info.arrays[record.header.number].coded_bytes += record.header.size;
    }
  }
}

}  // namespace

Result<FileInfo> inspect_stream(const Source& source) {
  const FileReader reader = MAILLE_TRY(FileReader::open(source, known_types));
  const StreamHeader header = MAILLE_TRY(decode_header(MAILLE_TRY(reader.read_stream({"DESC"}))));
  StreamTail tail;
  if (reader.has_stream({"TAIL"})) tail = MAILLE_TRY(decode_tail(MAILLE_TRY(reader.read_stream({"TAIL"}))));
  FileInfo info;
  info.format_major = reader.header().major;
  info.format_minor = reader.header().minor;
  info.mode = Mode::stream;
  info.effort = header.description.effort;
  info.order = header.description.any_order ? Order::canonical : Order::keep;
  info.file_bytes = source.size();
  info.points = tail.points;
  info.cells = tail.cells;
  info.corners = tail.corners;
  info.parts = std::max<uint64_t>(tail.batches, 1);
  for (const StreamTail::Block& block : tail.blocks) {
    const std::string type = std::string("(") + name_of(block.type) + ")";
    info.blocks.emplace_back(block.name.empty() ? type : block.name + " " + type, block.cells);
  }
  info.connectivity.name = "connectivity";
  info.connectivity.domain = Domain::corner;
  info.connectivity.type = Scalar::u64;
  info.connectivity.count = tail.corners;
  info.positions = info_of(header.description.positions, header.bounds[0], header.maps[0][0], tail.points);
  for (size_t i = 0; i < header.description.arrays.size(); ++i) {
    const StreamArray& array = header.description.arrays[i];
    info.arrays.push_back(info_of(array, header.bounds[i + 1], header.maps[i + 1][0],
                                  array.domain == Domain::point ? tail.points : tail.cells));
  }
  add_sizes(reader, info);
  info.metadata = header.description.metadata;
  info.provenance = header.description.provenance;
  info.chunks = reader.chunks();
  info.problems = reader.problems();
  return info;
}

}  // namespace maille
