#include "recode.h"

#include <unistd.h>

#include <algorithm>
#include <optional>

#include "in_parts.h"
#include "result.h"
#include "system.h"

namespace maille::tool {

namespace {

/// Standard input that remembers what was read of it, until somebody says that it is a stream: a pipe cannot
/// be rewound, and the next way of reading needs its beginning.
class RecordedStdin final : public ByteStream {
 public:
  explicit RecordedStdin(std::vector<std::byte>* record) : record_(record) {}
  Result<size_t> read(std::span<std::byte> out) override {
    const size_t count = TOOL_TRY(input_->read(out));
    *bytes_ += count;
    if (*recording_)
      record_->insert(record_->end(), out.begin(), out.begin() + static_cast<ptrdiff_t>(count));
    return count;
  }
  std::string name() const override { return "standard input"; }
  // The reader owns this stream soon; these stay with the caller, who stops the recording and shows how much
  // was read.
  std::shared_ptr<bool> recording() const { return recording_; }
  std::shared_ptr<uint64_t> bytes() const { return bytes_; }

 private:
  std::unique_ptr<ByteStream> input_ = descriptor_stream(STDIN_FILENO, "standard input");
  std::vector<std::byte>* record_;
  std::shared_ptr<bool> recording_ = std::make_shared<bool>(true);
  std::shared_ptr<uint64_t> bytes_ = std::make_shared<uint64_t>(0);
};

}  // namespace

Result<std::optional<InputStream>> open_stream(const std::string& path, const CommonOptions& common,
                                               Executor* executor, std::vector<std::byte>& begin) {
  const StreamReadOptions reading{.limits = {common.memory}, .executor = executor};
  if (path == "-") {
    if (isatty(STDIN_FILENO) != 0) return std::nullopt;
    auto input = std::make_unique<RecordedStdin>(&begin);
    const auto recording = input->recording();
    auto bytes = input->bytes();
    auto reader = StreamReader::open(std::move(input), reading);
    *recording = false;
    if (!reader && is_unreadable(reader.error())) return tl::unexpected(reader.error());
    if (!reader) return std::nullopt;
    begin = {};
    keep_memory_small();
    return InputStream{nullptr, *std::move(reader), std::move(bytes)};
  }
  if (!is_regular(path)) return std::nullopt;
  auto source = unmapped_source(path);
  if (!source) return std::nullopt;
  auto reader = StreamReader::open(source_stream(**source), reading);
  if (!reader && is_unreadable(reader.error())) return tl::unexpected(reader.error());
  if (!reader) return std::nullopt;
  keep_memory_small();
  return InputStream{*std::move(source), *std::move(reader), nullptr};
}

Result<std::unique_ptr<Source>> rest_of_stdin(std::vector<std::byte> begin) {
  auto rest = TOOL_TRY(stdin_source());
  if (begin.empty()) return rest;
  const Bytes bytes = rest->view();
  begin.insert(begin.end(), bytes.begin(), bytes.end());
  return memory_source(std::move(begin), rest->name());
}

namespace {

/// Gives portions of a stream to the writer of another, or to a spool.
template <class Writer>
class Recoder {
 public:
  Recoder(const StreamDescription& description, Writer& writer) : writer_(writer) {
    for (const StreamArray& array : description.arrays) {
      if (array.domain == Domain::cell) cell_sizes_.push_back(array.tuple_size());
    }
  }

  Result<> add(const StreamPortion& portion) {
    points_.assign(portion.point_arrays.begin(), portion.point_arrays.end());
    if (!portion.points.empty()) TOOL_CHECK(writer_.add_points(portion.points, portion.positions, points_));
    if (numbers_.size() < portion.slot_count) numbers_.resize(portion.slot_count);
    for (size_t i = 0; i < portion.points.size(); ++i) numbers_[portion.point_slots[i]] = portion.points[i];
    mark_ends(portion);
    size_t next_block = 0;
    for (size_t i = 0; i < portion.cell_count();) {
      TOOL_CHECK(begin_blocks(portion, i, next_block));
      i += TOOL_TRY(add_run(portion, i, next_block));
    }
    TOOL_CHECK(begin_blocks(portion, portion.cell_count(), next_block));
    return writer_.end_points(late_);
  }

 private:
  /// Points that end in the portion end with the last entry that names them, or, if none does, later.
  void mark_ends(const StreamPortion& portion) {
    ending_.assign(portion.slot_count, 0);
    for (const uint32_t slot : portion.ended_slots) ending_[slot] = 1;
    flags_.assign(portion.slots.size(), 0);
    for (size_t i = portion.slots.size(); i-- > 0;) {
      flags_[i] = ending_[portion.slots[i]];
      ending_[portion.slots[i]] = 0;
    }
    late_.clear();
    for (const uint32_t slot : portion.ended_slots) {
      if (ending_[slot] != 0) late_.push_back(numbers_[slot]);
    }
  }
  Result<> begin_blocks(const StreamPortion& portion, size_t cell, size_t& next) {
    for (; next < portion.blocks.size() && portion.blocks[next].first_cell <= portion.first_cell + cell;
         ++next)
      TOOL_CHECK(writer_.begin_block(portion.blocks[next].name, portion.blocks[next].type));
    return {};
  }
  /// Passes on as many cells at once as have the same type and number of nodes and belong to one block. A
  /// call for each cell would cost more than the cell.
  Result<size_t> add_run(const StreamPortion& portion, size_t i, size_t next_block) {
    const uint64_t nodes = portion.offsets[i + 1] - portion.offsets[i];
    const bool polyhedron = portion.types[i] == CellType::polyhedron;
    size_t end = polyhedron ? i + 1 : portion.cell_count();
    if (next_block < portion.blocks.size())
      end = std::min<size_t>(end, portion.blocks[next_block].first_cell - portion.first_cell);
    size_t next = i + 1;
    while (nodes != 0 && next < end && portion.types[next] == portion.types[i] &&
           portion.offsets[next + 1] - portion.offsets[next] == nodes)
      ++next;
    cells_.clear();
    for (size_t k = 0; k < cell_sizes_.size(); ++k)
      cells_.push_back(
          Bytes(portion.cell_arrays[k]).subspan(i * cell_sizes_[k], (next - i) * cell_sizes_[k]));
    const size_t begin = portion.offsets[i], corners = (next - i) * nodes;
    const auto points = std::span(portion.connectivity).subspan(begin, corners);
    const auto last = std::span(flags_).subspan(begin, corners);
    if (polyhedron) {
      const uint64_t face = portion.cell_faces[i], faces = portion.cell_faces[i + 1] - face;
      TOOL_CHECK(
          writer_.add_polyhedron(std::span(portion.face_sizes).subspan(face, faces), points, last, cells_));
    } else {
      TOOL_CHECK(writer_.add_cells(portion.types[i], points, last, cells_, nodes));
    }
    return next - i;
  }

  Writer& writer_;
  std::vector<size_t> cell_sizes_;
  std::vector<Bytes> points_, cells_;
  std::vector<uint64_t> numbers_;  ///< by slot
  std::vector<uint8_t> ending_, flags_;
  std::vector<uint64_t> late_;
};

ArrayReport report_of(const StreamArray& array, uint64_t count, uint64_t coded_bytes, double error) {
  ArrayReport report;
  report.name = array.name;
  report.domain = array.domain;
  report.type = array.type;
  report.components = array.components;
  report.elements = count;
  report.raw_bytes = count * array.tuple_size();
  report.coded_bytes = coded_bytes;
  report.lossless = array.tolerance.kind == Tolerance::Kind::lossless;
  report.bound = array.tolerance.kind == Tolerance::Kind::absolute ? array.tolerance.value : 0;
  report.asked = array.tolerance;
  report.maximum_error = error;
  return report;
}

EncodeReport report_of(const StreamOptions& options, const StreamReport& stream) {
  EncodeReport report;
  report.points = stream.points;
  report.cells = stream.cells;
  report.file_bytes = stream.file_bytes;
  report.connectivity.name = "connectivity";
  report.connectivity.domain = Domain::cell;
  report.connectivity.type = Scalar::u32;
  report.connectivity.elements = stream.cells;
  report.connectivity.raw_bytes = stream.corners * 4;
  report.connectivity.coded_bytes = stream.cell_bytes;
  report.order_bytes = stream.number_bytes;
  report.positions = report_of(options.positions, stream.points, stream.position_bytes, stream.errors[0]);
  // What is left when all that is known was taken away: headers, checksums, index and metadata.
  report.other_bytes = stream.file_bytes - stream.cell_bytes - stream.number_bytes - stream.position_bytes;
  for (size_t i = 0; i < options.arrays.size(); ++i) {
    const uint64_t count = options.arrays[i].domain == Domain::point ? stream.points : stream.cells;
    report.arrays.push_back(report_of(options.arrays[i], count, stream.array_bytes[i], stream.errors[i + 1]));
    report.other_bytes -= stream.array_bytes[i];
  }
  return report;
}

}  // namespace

namespace {

StreamOptions options_of(const StreamDescription& from, const EncodeOptions& encoding) {
  StreamOptions options;
  options.positions = from.positions;
  options.positions.tolerance = encoding.positions;
  options.arrays = from.arrays;
  for (StreamArray& array : options.arrays) {
    const auto asked = encoding.arrays.find(array.name);
    array.tolerance = asked == encoding.arrays.end() ? Tolerance{} : asked->second;
  }
  options.mesh_arrays = from.mesh_arrays;
  options.metadata = from.metadata;
  return options;
}

template <class Writer>
Result<> add_all(InputStream& input, Writer& writer, ProgressDisplay& progress) {
  Recoder<Writer> recoder(input.reader.description(), writer);
  const Progress watch = progress.watch(0, "cells");
  StreamPortion portion;
  while (TOOL_TRY(input.reader.next(portion))) {
    TOOL_CHECK(recoder.add(portion));
    if (watch) watch({"cells", 0});
  }
  return {};
}

}  // namespace

Result<EncodeReport> compress_stream(InputStream& input, Sink& sink, const EncodeOptions& encoding,
                                     uint64_t delay, ProgressDisplay& progress) {
  const StreamDescription& from = input.reader.description();
  StreamOptions options = options_of(from, encoding);
  options.delay = delay;
  options.provenance = encoding.provenance;
  options.effort = encoding.effort;
  options.any_order = from.any_order || encoding.order == Order::canonical;
  options.time = encoding.time;
  options.executor = encoding.executor;
  StreamWriter writer = TOOL_TRY(StreamWriter::begin(sink, options));
  TOOL_CHECK(add_all(input, writer, progress));
  return report_of(options, TOOL_TRY(writer.finish()));
}

Result<std::unique_ptr<MeshSource>> spool_stream(InputStream& input, const WorkingSpace& space,
                                                 ProgressDisplay& progress) {
  MeshSpool spool = TOOL_TRY(MeshSpool::create(options_of(input.reader.description(), {}), space));
  TOOL_CHECK(add_all(input, spool, progress));
  return spool.finish();
}

}  // namespace maille::tool
