#include "volume/stream_file.h"

#include <maille/stream.h>

#include <algorithm>

#include "base/pace.h"
#include "base/result.h"
#include "container/file_reader.h"
#include "surface/array_report.h"
#include "volume/cell_order.h"
#include "volume/mesh_order.h"
#include "volume/mesh_stream.h"
#include "volume/stream_layout.h"
#include "volume/time_steps.h"

namespace maille {
namespace {

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

/// When each point is used last, counted in cells as written; none for points that no cell uses.
std::vector<uint64_t> last_cells(const Mesh& mesh, const CellOrders& orders) {
  std::vector<uint64_t> last(mesh.point_count(), ~uint64_t{0});
  uint64_t time = 0;
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    const CellBlock& block = mesh.blocks[b];
    const uint64_t nodes = nodes_of(block.type);
    if (nodes != 0 && orders[b].empty()) {
      const uint64_t cells = block.connectivity.size() / nodes;
      const uint32_t* point = block.connectivity.data();
      for (uint64_t i = 0; i < cells; ++i, ++time) {
        for (uint64_t k = 0; k < nodes; ++k) last[*point++] = time;
      }
      continue;
    }
    for (uint64_t i = 0; i < block.size(); ++i, ++time) {
      for (const uint32_t point : block.cell(orders[b].empty() ? i : orders[b][i])) last[point] = time;
    }
  }
  return last;
}

/// What the connectivity of the first cells takes in these orders, in bytes; with the numbers of points if
/// they are kept.
size_t trial(const Mesh& mesh, const CellOrders& orders, const std::vector<uint64_t>& last, bool mixed,
             uint64_t most_cells, bool numbered = false) {
  RangeEncoder topology, numbers;
  CellCoder<RangeEncoder> coder(mixed, numbered);
  CodedCells out;
  StreamedCell cell;
  uint64_t time = 0;
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    const CellBlock& block = mesh.blocks[b];
    for (uint64_t i = 0; i < block.size() && time < most_cells; ++i, ++time) {
      const uint64_t number = orders[b].empty() ? i : orders[b][i];
      cell.kind =
          kind_of(block.type == CellType::mixed ? static_cast<CellType>(block.types[number]) : block.type);
      if (cell.kind >= shape_count) continue;
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
  return topology.finish().size() + (numbered ? numbers.finish().size() : 0);
}

/// In which order cells are written, and the bytes that give the input's order back if that is to be kept.
struct Ordering {
  CellOrders orders;
  std::optional<CodedOrder> apart;
};

bool all_have_shapes(const Mesh& mesh) {
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      if (kind_of(block.type_of(i)) >= shape_count) return false;
    }
  }
  return true;
}

/// Where the order is kept: as they are, unless cells come so scattered that the order of the front is
/// smaller with the input's order beside it.
Ordering keep_order(const Mesh& mesh, bool mixed) {
  constexpr uint64_t sample = 20'000;
  constexpr uint64_t scattered = 1;  // bytes a cell: less is a good order already
  const CellOrders as_they_are(mesh.blocks.size());
  const uint64_t cells = mesh.cell_count(), tried = std::min(cells, sample);
  if (cells >= no_cell || !all_have_shapes(mesh)) return {as_they_are, {}};
  const size_t natural = trial(mesh, as_they_are, last_cells(mesh, as_they_are), mixed, sample, true);
  if (natural <= tried * scattered) return {as_they_are, {}};
  CellOrders by_front;
  for (const CellBlock& block : mesh.blocks) by_front.push_back(front_order(block));
  const size_t front = trial(mesh, by_front, last_cells(mesh, by_front), mixed, sample);
  CodedOrder order = encode_order(mesh, by_front);
  const uint64_t apart = order.points.size() + order.cells.size();
  if (natural * cells <= front * cells + apart * tried) return {as_they_are, {}};
  return {std::move(by_front), std::move(order)};
}

/// Where any order will do: as they are, if that is a good order, else as the front meets them.
CellOrders choose_orders(const Mesh& mesh, bool mixed) {
  CellOrders as_they_are(mesh.blocks.size());
  CellOrders by_front;
  for (const CellBlock& block : mesh.blocks) by_front.push_back(front_order(block));
  const std::vector<uint64_t> last = last_cells(mesh, as_they_are),
                              last_by_front = last_cells(mesh, by_front);
  // Some thousand cells mostly decide: cells in no order at all take long to try.
  for (const uint64_t cells : {uint64_t{5'000}, uint64_t{400'000}}) {
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
  MeshFeeder(const Mesh& mesh, StreamWriter& writer, const CellOrders& orders, const EncodeOptions& options)
      : mesh_(mesh),
        writer_(writer),
        orders_(orders),
        last_(last_cells(mesh, orders_)),
        pace_(options.progress, "cells", mesh.cell_count()),
        executor_(options.executor ? *options.executor : serial_executor()) {
    for (const Array& array : mesh.arrays) {
      if (array.domain == Domain::cell) columns_.push_back(&array);
    }
    arrays_.resize(columns_.size());
  }
  Result<> feed() {
    for (size_t b = 0; b < mesh_.blocks.size(); ++b) {
      const CellBlock& block = mesh_.blocks[b];
      MAILLE_CHECK(writer_.begin_block(block.name, block.type));
      const bool plain = orders_[b].empty() && nodes_of(block.type) != 0;
      if (plain) MAILLE_CHECK(feed_plain(block));
      for (uint64_t i = 0; i < block.size() && !plain;) i += MAILLE_TRY(feed_run(block, orders_[b], i));
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
    const bool single = nodes == 0 || type_of(first) == CellType::polyhedron;
    const uint64_t most = single ? 1 : std::min<uint64_t>(512, block.size() - first);
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
    if (type_of(first) == CellType::polyhedron) {
      MAILLE_CHECK(writer_.add_polyhedron(block.faces(cell_at(first)), numbers_, finals_, arrays));
      return count;
    }
    MAILLE_CHECK(writer_.add_cells(type_of(first), numbers_, finals_, arrays, nodes));
    return count;
  }

  /// Cells of one type in their order: while some are coded the next ones are made ready.
  Result<> feed_plain(const CellBlock& block) {
    const size_t nodes = nodes_of(block.type);
    const uint64_t cells = block.connectivity.size() / nodes;
    std::array<Run, 2> runs;
    fill(block, 0, std::min<uint64_t>(cells, cells_per_block), runs[0]);
    for (uint64_t first = 0, k = 0; first < cells; first += cells_per_block, k = 1 - k) {
      const uint64_t next = first + cells_per_block;
      Result<> added;
      executor_.parallel_for(2, [&](size_t task) {
        if (task == 0) {
          added = writer_.add_cells(block.type, runs[k].numbers, runs[k].finals, runs[k].arrays, nodes);
        } else if (next < cells) {
          fill(block, next, std::min<uint64_t>(cells - next, cells_per_block), runs[1 - k]);
        }
      });
      MAILLE_CHECK(added);
      for (uint64_t i = first; i < next && i < cells; ++i) {
        if (!pace_.step()) return cancelled();
      }
    }
    return {};
  }

  struct Run {
    std::vector<uint64_t> numbers;
    std::vector<uint8_t> finals;
    std::vector<Bytes> arrays;
  };
  void fill(const CellBlock& block, uint64_t first, uint64_t count, Run& run) const {
    const size_t nodes = nodes_of(block.type);
    const auto points = std::span(block.connectivity).subspan(first * nodes, count * nodes);
    run.numbers.assign(points.begin(), points.end());
    run.finals.resize(points.size());
    for (uint64_t i = 0, at = 0; i < count; ++i) {
      for (size_t k = 0; k < nodes; ++k, ++at) run.finals[at] = last_[points[at]] == first_ + first + i;
    }
    run.arrays.clear();
    for (const Array* column : columns_) {
      const size_t size = column->tuple_size();
      run.arrays.push_back(Bytes(column->bytes).subspan((first_ + first) * size, count * size));
    }
  }

  const Mesh& mesh_;
  StreamWriter& writer_;
  const CellOrders& orders_;
  std::vector<uint64_t> last_;
  Pace pace_;
  Executor& executor_;
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

EncodeReport report_of(const Mesh& mesh, const StreamReport& stream, const ArrayMapsList& maps,
                       const std::optional<CodedOrder>& order) {
  EncodeReport report = report_of(mesh);
  report.file_bytes = stream.file_bytes;
  report.connectivity.coded_bytes = stream.cell_bytes + (order ? order->cells.size() : 0);
  report.order_bytes = stream.number_bytes + (order ? order->points.size() : 0);
  report.positions = report_of(mesh.points, maps.maps[0], maps.bounds[0], stream.position_bytes);
  report.other_bytes =
      stream.file_bytes - report.connectivity.coded_bytes - report.order_bytes - stream.position_bytes;
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
  ArrayMapsList maps = MAILLE_TRY(choose_stream_maps(mesh, stream_options));
  const bool mixed = mixes(options.effort);
  const Ordering ordering =
      options.order == Order::keep ? keep_order(mesh, mixed) : Ordering{choose_orders(mesh, mixed), {}};
  if (ordering.apart) {
    stream_options.any_order = true;
    maps.order_apart = join_order(*ordering.apart);
  }
  StreamWriter writer = MAILLE_TRY(begin_with_maps(sink, std::move(stream_options), maps));
  MAILLE_CHECK(MeshFeeder(mesh, writer, ordering.orders, options).feed());
  const StreamReport stream = MAILLE_TRY(writer.finish());
  return report_of(mesh, stream, maps, ordering.apart);
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
    const bool plain =
        piece.blocks.empty() && !mesh_.blocks.empty() && nodes_of(mesh_.blocks.back().type) != 0;
    if (plain) MAILLE_CHECK(add_plain_cells(piece, name));
    for (size_t i = 0; i <= piece.cell_count() && !plain; ++i) {
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

  /// A part of a mesh: points that never came up leave gaps in the numbers.
  Result<> close_gaps(const std::string& name) {
    std::vector<uint64_t> known = numbers_;
    std::sort(known.begin(), known.end());
    const auto place = [&](uint64_t number) {
      return static_cast<uint64_t>(std::lower_bound(known.begin(), known.end(), number) - known.begin());
    };
    for (CellBlock& block : mesh_.blocks) {
      for (uint32_t& point : block.connectivity) {
        const uint64_t now = place(point);
        if (now == known.size() || known[now] != point)
          return failure(ErrorCode::corrupt, name + ": a cell has a point that never came up");
        point = static_cast<uint32_t>(now);
      }
    }
    for (uint64_t& number : numbers_) number = place(number);
    return {};
  }

  /// `order`: the input's, where the stream has another one.
  Result<Mesh> finish(const std::string& name, const std::optional<CodedOrder>& order) {
    MAILLE_CHECK(put_in_place(name));
    for (size_t k = 0; k < arrays_.size(); ++k) {
      if (wanted_[k]) mesh_.arrays.push_back(std::move(arrays_[k]));
    }
    for (Array& array : mesh_arrays_) mesh_.arrays.push_back(std::move(array));
    if (auto valid = validate(mesh_); !valid) {
      return failure(ErrorCode::corrupt, name + ": " + std::move(valid).error().message);
    }
    if (order && !(all_have_shapes(mesh_) && restore_order(mesh_, *order))) {
      return failure(ErrorCode::corrupt, name + ": the order of cells and points is damaged");
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
  tl::unexpected<Error> too_many_points(const std::string& name) const {
    return failure(ErrorCode::memory_bound,
                   name + ": more points than a mesh in memory can have; read it in pieces");
  }
  /// Cells of the block's only type: the reader has looked at their types.
  Result<> add_plain_cells(const StreamPiece& piece, const std::string& name) {
    std::vector<uint32_t>& connectivity = mesh_.blocks.back().connectivity;
    uint64_t largest = 0;
    for (const uint64_t point : piece.connectivity) largest = std::max(largest, point);
    if (largest > max_points) return too_many_points(name);
    const size_t before = connectivity.size();
    connectivity.resize(before + piece.connectivity.size());
    for (size_t k = 0; k < piece.connectivity.size(); ++k) {
      connectivity[before + k] = static_cast<uint32_t>(piece.connectivity[k]);
    }
    size_ += piece.connectivity.size() * 4;
    return {};
  }
  Result<> add_cell(const StreamPiece& piece, size_t i, const std::string& name) {
    CellBlock& block = mesh_.blocks.back();
    if (nodes_of(block.type) == 0 && block.offsets.empty()) block.offsets.push_back(0);
    for (uint64_t k = piece.offsets[i]; k < piece.offsets[i + 1]; ++k) {
      if (piece.connectivity[k] > max_points) return too_many_points(name);
      block.connectivity.push_back(static_cast<uint32_t>(piece.connectivity[k]));
    }
    if (nodes_of(block.type) == 0) block.offsets.push_back(block.connectivity.size());
    add_faces(piece, i, block);
    if (block.type == CellType::mixed) block.types.push_back(static_cast<uint8_t>(piece.types[i]));
    size_ += (piece.offsets[i + 1] - piece.offsets[i]) * 4 + (nodes_of(block.type) == 0 ? 9 : 0);
    return {};
  }
  void add_faces(const StreamPiece& piece, size_t i, CellBlock& block) {
    const bool polyhedron = piece.types[i] == CellType::polyhedron;
    if (!polyhedron && block.cell_faces.empty()) return;
    if (block.cell_faces.empty()) block.cell_faces.assign(block.offsets.size() - 1, 0);
    if (polyhedron) {
      const auto begin = piece.face_sizes.begin();
      block.face_sizes.insert(block.face_sizes.end(), begin + static_cast<ptrdiff_t>(piece.cell_faces[i]),
                              begin + static_cast<ptrdiff_t>(piece.cell_faces[i + 1]));
      size_ += (piece.cell_faces[i + 1] - piece.cell_faces[i]) * 4;
    }
    block.cell_faces.push_back(block.face_sizes.size());
    size_ += 8;
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

namespace {

/// Files whose order stands apart are read, too.
Result<StreamReader> open_any(const Source& source, const DecodeOptions& options) {
  StreamReadOptions opened;
  opened.limits = options.limits;
  opened.any_order = true;
  opened.executor = options.executor;
  return StreamReader::open(source, options.step, opened);
}

/// The input's order, where it stands apart.
Result<std::optional<CodedOrder>> order_of(const Source& source, const StreamDescription& description) {
  if (!description.order_apart) return std::optional<CodedOrder>();
  const FileReader file = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  const std::vector<std::byte> bytes = MAILLE_TRY(file.read_stream({"ordr"}));
  std::optional<CodedOrder> order = split_order(bytes);
  if (!order)
    return failure(ErrorCode::corrupt, source.name() + ": the order of cells and points is damaged");
  return order;
}

}  // namespace

Result<std::optional<InputOrder>> input_order_of(const Source& source, const Limits& limits) {
  DecodeOptions options;
  options.limits = limits;
  options.arrays.emplace();
  StreamReader reader = MAILLE_TRY(open_any(source, options));
  const auto order = MAILLE_TRY(order_of(source, reader.description()));
  if (!order) return std::optional<InputOrder>();
  MeshCollector collector(reader.description(), options);
  StreamPiece piece;
  while (MAILLE_TRY(reader.next(piece))) MAILLE_CHECK(collector.add(piece, source.name()));
  const Mesh coded = MAILLE_TRY(collector.finish(source.name(), {}));
  std::optional<InputOrder> found = all_have_shapes(coded) ? decode_order(coded, *order) : std::nullopt;
  if (!found)
    return failure(ErrorCode::corrupt, source.name() + ": the order of cells and points is damaged");
  return found;
}

Result<Mesh> decode_stream(const Source& source, const DecodeOptions& options) {
  StreamReader reader = MAILLE_TRY(open_any(source, options));
  const auto order = MAILLE_TRY(order_of(source, reader.description()));
  MeshCollector collector(reader.description(), options);
  Executor& executor = options.executor ? *options.executor : serial_executor();
  std::array<StreamPiece, 2> pieces;
  bool more = MAILLE_TRY(reader.next(pieces[0]));
  for (unsigned k = 0; more; k = 1 - k) {
    // One piece goes to its place while the next is decoded.
    Result<bool> following = false;
    Result<> added;
    executor.parallel_for(2, [&](size_t task) {
      if (task == 0) {
        following = reader.next(pieces[1 - k]);
      } else {
        added = collector.add(pieces[k], source.name());
      }
    });
    MAILLE_CHECK(added);
    more = MAILLE_TRY(following);
    if (options.progress && !options.progress({"cells", 0})) return cancelled();
  }
  return collector.finish(source.name(), order);
}

Result<Salvaged> salvage_stream(const Source& source, const DecodeOptions& options) {
  StreamReader reader = MAILLE_TRY(open_any(source, options));
  MeshCollector collector(reader.description(), options);
  Salvaged salvaged;
  StreamPiece piece;
  for (;;) {
    const Result<bool> more = reader.next(piece);
    if (!more && more.error().code != ErrorCode::corrupt) return tl::unexpected(more.error());
    if (!more) salvaged.damage = more.error();
    if (!more || !*more) break;
    MAILLE_CHECK(collector.add(piece, source.name()));
    if (options.progress && !options.progress({"cells", 0})) return cancelled();
  }
  // Of a part the input's order says nothing.
  std::optional<CodedOrder> order;
  if (salvaged.damage) {
    MAILLE_CHECK(collector.close_gaps(source.name()));
  } else {
    order = MAILLE_TRY(order_of(source, reader.description()));
  }
  salvaged.mesh = MAILLE_TRY(collector.finish(source.name(), order));
  return salvaged;
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

/// Models and buffers; slots of points, cells and values; a bit for each point that is written. Measured: a
/// front of 100,000 points takes 40 MB.
uint64_t decode_bytes_of(const StreamHeader& header, const StreamTail& tail) {
  constexpr uint64_t models = uint64_t{18} << 20, point_and_cell = 168, value = 16;
  uint64_t components = header.description.positions.components;
  for (const StreamArray& array : header.description.arrays) components += array.components;
  const uint64_t most =
      std::min(std::max(tail.most_live_points, tail.most_live_cells), tail.points + tail.cells);
  return models + most * (point_and_cell + value * components) + tail.points / 8;
}

void add_sizes(const FileReader& reader, FileInfo& info) {
  for (const ChunkRecord& record : reader.records()) {
    const std::string_view type(record.header.type.data(), record.header.type.size());
    if (type == "CELL" || type == "ordr") info.connectivity.coded_bytes += record.header.size;
    if (type == "POSI") info.positions.coded_bytes += record.header.size;
    if (type == "ARRY" && record.header.number < info.arrays.size()) {
      info.arrays[record.header.number].coded_bytes += record.header.size;
    }
  }
}

}  // namespace

Result<FileInfo> inspect_stream(const Source& source) {
  const FileReader reader = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  const StreamHeader header = MAILLE_TRY(decode_header(MAILLE_TRY(reader.read_stream({"DESC"}))));
  StreamTail tail;
  if (reader.has_stream({"TAIL"})) tail = MAILLE_TRY(decode_tail(MAILLE_TRY(reader.read_stream({"TAIL"}))));
  FileInfo info;
  info.format_major = reader.header().major;
  info.format_minor = reader.header().minor;
  info.mode = Mode::stream;
  info.effort = header.description.effort;
  const StreamDescription& description = header.description;
  info.order = description.any_order && !description.order_apart ? Order::canonical : Order::keep;
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
  info.most_points_in_use = tail.most_live_points;
  info.decode_bytes = decode_bytes_of(header, tail);
  add_sizes(reader, info);
  const auto steps = list_steps(source);
  if (!steps && steps.error().code != ErrorCode::corrupt) return tl::unexpected(steps.error());
  for (const StreamStep& step : steps ? *steps : std::vector<StreamStep>{}) {
    StepInfo& added = info.steps.emplace_back();
    added.time = step.time;
    added.coded_bytes = step.coded_bytes;
    for (const StreamArray& array : step.arrays) added.arrays.push_back(array.name);
  }
  info.metadata = header.description.metadata;
  info.provenance = header.description.provenance;
  info.chunks = reader.chunks();
  info.problems = reader.problems();
  if (!steps) info.problems.push_back(steps.error().message);
  return info;
}

Result<StreamEnds> read_stream_ends(const Source& source) {
  const FileReader reader = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  if (reader.header().mode != Mode::stream)
    return failure(ErrorCode::unsupported, source.name() + ": a file of another mode than \"stream\"");
  MAILLE_CHECK(reader.check_complete());
  const std::vector<std::byte> description = MAILLE_TRY(reader.read_stream({"DESC"}));
  const std::vector<std::byte> tail = MAILLE_TRY(reader.read_stream({"TAIL"}));
  StreamEnds ends;
  ends.header = MAILLE_TRY(decode_header(description));
  ends.tail = MAILLE_TRY(decode_tail(tail));
  return ends;
}

}  // namespace maille
