// Values of later times behind a mesh. docs/format.md, "Steps".
#include "volume/stream/time_steps.h"

#include <algorithm>
#include <cmath>

#include "base/result.h"
#include "container/chunk_finder.h"
#include "volume/stream/cell_replay.h"
#include "volume/stream/mesh_stream.h"
#include "volume/stream/stream_file.h"
#include "volume/values/array_stage.h"

namespace maille {
namespace {

/// Key of the values of array i of a step in a batch. Error: unsupported, beyond 2^32 of them.
Result<StreamKey> key_of(uint64_t step, uint64_t batch, uint64_t array, uint64_t arrays) {
  const uint64_t number = batch * arrays + array;
  if (step > UINT32_MAX || number > UINT32_MAX)
    return failure(ErrorCode::unsupported, "more steps, or arrays in a step, than a file can hold");
  return StreamKey{"SVAL", static_cast<uint32_t>(step), static_cast<uint32_t>(number)};
}

uint64_t count_steps(const FileReader& file) {
  uint64_t count = 0;
  while (count < UINT32_MAX && file.has_stream({"STEP", static_cast<uint32_t>(count + 1), 0})) ++count;
  return count;
}

Result<StreamHeader> header_of(const FileReader& file) {
  return decode_header(MAILLE_TRY(file.read_stream({"DESC"})));
}

}  // namespace

Result<std::vector<StepHeader>> read_steps(const FileReader& file, const std::vector<StreamArray>& arrays) {
  // A source whose bytes arrive later is asked for all of them before the first that is missing is an error.
  std::vector<Result<std::vector<std::byte>>> streams;
  const uint64_t count = count_steps(file);
  for (uint32_t i = 1; i <= count; ++i) streams.push_back(file.read_stream({"STEP", i, 0}));
  std::vector<StepHeader> steps;
  for (auto& stream : streams)
    steps.push_back(MAILLE_TRY(decode_step(MAILLE_TRY(std::move(stream)), arrays)));
  return steps;
}

Result<StepValues> StepValues::open(const Source& source, uint64_t number) {
  FileReader file = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  MAILLE_CHECK(file.check_complete());
  const uint64_t count = count_steps(file);
  if (number == 0 || number > count) {
    return failure(ErrorCode::usage, source.name() + ": has no step " + std::to_string(number) +
                                         "; the last one is " + std::to_string(count));
  }
  const StreamHeader mesh = MAILLE_TRY(header_of(file));
  const auto step = static_cast<uint32_t>(number);
  StepHeader header =
      MAILLE_TRY(decode_step(MAILLE_TRY(file.read_stream({"STEP", step, 0})), mesh.description.arrays));
  return StepValues(std::move(file), step, std::move(header));
}

Result<std::vector<std::byte>> StepValues::read(uint32_t batch, size_t array) const {
  return file_.read_stream(MAILLE_TRY(key_of(number_, batch, array, header_.arrays.size())));
}

namespace {

/// Arrays that have, element by element, the values that the mesh came with: 1 + its array; else 0. The
/// mesh's values are read until all arrays differ.
Result<std::vector<uint32_t>> find_same(const Source& source, const std::vector<StreamArray>& arrays,
                                        const StreamHeader& mesh, StepSource& values,
                                        const StepOptions& options) {
  std::vector<uint32_t> same(arrays.size());
  const std::vector<StreamArray>& known = mesh.description.arrays;
  size_t left = 0;
  for (size_t i = 0; i < arrays.size(); ++i) {
    for (size_t k = 0; k < known.size() && same[i] == 0; ++k) {
      const bool alike = known[k].name == arrays[i].name && known[k].domain == arrays[i].domain &&
                         known[k].type == arrays[i].type && known[k].components == arrays[i].components;
      if (alike && mesh.bounds[k + 1] == 0) same[i] = static_cast<uint32_t>(k + 1);
    }
    left += same[i] != 0;
  }
  if (left == 0) return same;
  StreamReader reader = MAILLE_TRY(StreamReader::open(
      source_stream(source), {.limits = options.limits, .any_order = true, .executor = options.executor}));
  StreamPiece piece;
  std::vector<std::byte> tuple;
  while (left > 0 && MAILLE_TRY(reader.next(piece))) {
    for (size_t i = 0; i < arrays.size(); ++i) {
      if (same[i] == 0) continue;
      const bool points = arrays[i].domain == Domain::point;
      size_t place = 0;  // among the arrays of the domain
      for (size_t k = 0; k + 1 < same[i]; ++k) place += known[k].domain == arrays[i].domain;
      const auto& bytes = points ? piece.point_arrays[place] : piece.cell_arrays[place];
      const size_t size = arrays[i].tuple_size();
      tuple.resize(size);
      for (size_t at = 0; at * size < bytes.size() && same[i] != 0; ++at) {
        MAILLE_CHECK(values.read(i, points ? piece.points[at] : piece.first_cell + at, tuple.data()));
        if (std::equal(tuple.begin(), tuple.end(), bytes.begin() + static_cast<ptrdiff_t>(at * size)))
          continue;
        same[i] = 0;
        --left;
      }
    }
  }
  return same;
}

/// Codes the values of one step behind the cells, batch by batch.
class StepWriter {
 public:
  StepWriter(const FileReader& file, const StreamHeader& mesh, const StepHeader& step, uint64_t number,
             StepSource& values, const StepOptions& options, FileWriter writer)
      : step_(step),
        number_(number),
        values_(values),
        executor_(options.executor ? *options.executor : serial_executor()),
        replay_(file, mesh, options.limits),
        writer_(std::move(writer)) {
    for (size_t i = 0; i < step.arrays.size(); ++i)
      stages_.emplace_back(step.array(i, mesh), step.arrays[i].domain);
    tuples_.resize(stages_.size());
    report_.array_bytes.resize(stages_.size());
  }

  Result<StepReport> write() {
    const StreamKey key{"STEP", static_cast<uint32_t>(number_), 0};
    MAILLE_CHECK(writer_.write_stream(key, MAILLE_TRY(encode_step(step_))));
    while (MAILLE_TRY(replay_.next_batch())) MAILLE_CHECK(write_batch());
    report_.number = number_;
    report_.file_bytes = MAILLE_TRY(writer_.finish());
    return report_;
  }

 private:
  Result<> write_batch() {
    for (auto& stage : stages_) stage.begin_batch(RansEncoder(stage.lanes()));
    while (MAILLE_TRY(replay_.next_block(cells_))) {
      MAILLE_CHECK(take_values());
      executor_.parallel_for(stages_.size(), [&](size_t i) {
        if (step_.same_as[i] == 0) stages_[i].code(cells_, tuples_[i].data());
      });
      first_cell_ += cells_.size();
    }
    for (size_t i = 0; i < stages_.size(); ++i) {
      const BatchHeader& batch = replay_.batch();
      const uint64_t count = stages_[i].domain() == Domain::point ? batch.points : batch.cells;
      if (count == 0 || step_.same_as[i] != 0) continue;
      const std::vector<std::byte> bytes = stages_[i].coder().finish();
      report_.array_bytes[i] += bytes.size();
      const StreamKey key = MAILLE_TRY(key_of(number_, replay_.batch_number(), i, stages_.size()));
      MAILLE_CHECK(writer_.write_stream(key, bytes));
    }
    return {};
  }
  Result<> take_values() {
    for (size_t i = 0; i < stages_.size(); ++i) {
      if (step_.same_as[i] != 0) continue;
      const bool points = stages_[i].domain() == Domain::point;
      const size_t size = stages_[i].tuple_size(), count = points ? cells_.points.size() : cells_.size();
      tuples_[i].resize(count * size);
      for (size_t k = 0; k < count; ++k) {
        const uint64_t number = points ? cells_.points[k].number : first_cell_ + k;
        MAILLE_CHECK(values_.read(i, number, tuples_[i].data() + k * size));
      }
    }
    return {};
  }

  const StepHeader& step_;
  uint64_t number_;
  StepSource& values_;
  Executor& executor_;
  CellReplay replay_;
  FileWriter writer_;
  std::vector<ArrayStage<RansEncoder>> stages_;
  std::vector<std::vector<std::byte>> tuples_;
  CodedCells cells_;
  uint64_t first_cell_ = 0;
  StepReport report_;
};

Result<> check_arrays(const std::vector<StreamArray>& arrays) {
  for (const StreamArray& array : arrays) {
    if (array.components == 0 || array.components > 0xffff)
      return failure(ErrorCode::usage, "array \"" + array.name + "\" must have 1 to 65535 components");
    if (array.domain != Domain::point && array.domain != Domain::cell)
      return failure(ErrorCode::unsupported, "array \"" + array.name + "\" is on " + name_of(array.domain) +
                                                 "s; a step has arrays on points and on cells");
  }
  return {};
}

struct Counts {
  uint64_t points, cells;
};

/// Values of a mesh whose cells and points stand in another order in the stream.
class InOrderOfStream final : public StepSource {
 public:
  InOrderOfStream(StepSource& values, const InputOrder& order, std::vector<StreamArray> arrays)
      : values_(values),
        points_(inverse(order.points)),
        cells_(inverse(order.cells)),
        arrays_(std::move(arrays)) {}
  Result<> read(size_t array, uint64_t number, std::byte* out) override {
    const auto& input = arrays_[array].domain == Domain::point ? points_ : cells_;
    if (number >= input.size())
      return failure(ErrorCode::corrupt, "a point or cell that the order does not name");
    return values_.read(array, input[number], out);
  }

 private:
  static std::vector<uint32_t> inverse(const std::vector<uint32_t>& places) {
    std::vector<uint32_t> numbers(places.size());
    for (uint32_t i = 0; i < places.size(); ++i) numbers[places[i]] = i;
    return numbers;
  }

  StepSource& values_;
  std::vector<uint32_t> points_, cells_;
  std::vector<StreamArray> arrays_;
};

Result<StepReport> write_step(const std::string& path, const Source& source, const FileReader& file,
                              const StreamHeader& mesh, StepHeader step, StepSource& values,
                              const StepOptions& options) {
  step.same_as = MAILLE_TRY(find_same(source, step.arrays, mesh, values, options));
  const std::unique_ptr<Sink> sink = MAILLE_TRY(append_sink(path, file.end()));
  StepWriter writer(file, mesh, step, count_steps(file) + 1, values, options,
                    FileWriter::resume(*sink, file.end(), file.digest()));
  const StepReport report = MAILLE_TRY(writer.write());
  MAILLE_CHECK(sink->commit());
  return report;
}

/// `counts`: of what the values are of, if known.
Result<StepReport> append(const std::string& path, StepHeader step, StepSource& values,
                          const StepOptions& options, const std::optional<Counts>& counts) {
  if (!std::isfinite(step.time))
    return failure(ErrorCode::usage, path + ": the time of a step has to be a finite number");
  MAILLE_CHECK(check_arrays(step.arrays));
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(path));
  const FileReader file = MAILLE_TRY(FileReader::open(*source, stream_chunk_types));
  MAILLE_CHECK(file.check_complete());
  if (file.header().mode != Mode::stream)
    return failure(ErrorCode::usage, path + ": steps can be appended to files of mode \"stream\" only");
  const StreamHeader mesh = MAILLE_TRY(header_of(file));
  if (mesh.description.any_order && !mesh.description.order_apart) {
    return failure(ErrorCode::usage,
                   path +
                       ": was compressed in any order, so values of later steps do not know their points; "
                       "compress it without --any-order");
  }
  const StreamTail tail = MAILLE_TRY(decode_tail(MAILLE_TRY(file.read_stream({"TAIL"}))));
  if (counts && (counts->points != tail.points || counts->cells != tail.cells)) {
    return failure(ErrorCode::usage, path + ": has " + std::to_string(tail.points) + " points and " +
                                         std::to_string(tail.cells) + " cells, the step has " +
                                         std::to_string(counts->points) + " and " +
                                         std::to_string(counts->cells));
  }
  const auto order = MAILLE_TRY(input_order_of(*source, options.limits));
  if (order) {
    InOrderOfStream reordered(values, *order, step.arrays);
    return write_step(path, *source, file, mesh, std::move(step), reordered, options);
  }
  return write_step(path, *source, file, mesh, std::move(step), values, options);
}

/// Arrays of a mesh in memory.
class MeshValues final : public StepSource {
 public:
  explicit MeshValues(std::vector<const Array*> arrays) : arrays_(std::move(arrays)) {}
  Result<> read(size_t array, uint64_t number, std::byte* out) override {
    const size_t size = arrays_[array]->tuple_size();
    if ((number + 1) * size > arrays_[array]->bytes.size())
      return failure(ErrorCode::usage, "the step has no point or cell " + std::to_string(number));
    std::copy_n(arrays_[array]->bytes.data() + number * size, size, out);
    return {};
  }

 private:
  std::vector<const Array*> arrays_;
};

}  // namespace

Result<StepReport> append_step(const std::string& path, const StepOptions& options, StepSource& values) {
  StepHeader step;
  step.time = options.time;
  step.arrays = options.arrays;
  for (const StreamArray& array : options.arrays) {
    double bound = 0;
    step.maps.push_back(MAILLE_TRY(declared_maps(array, declared_width(array), bound)));
    step.bounds.push_back(bound);
  }
  return append(path, std::move(step), values, options, {});
}

Result<StepReport> append_step(const std::string& path, double time, const Mesh& mesh,
                               const EncodeOptions& options) {
  MAILLE_CHECK(validate(mesh));
  StepHeader step;
  step.time = time;
  std::vector<const Array*> columns;
  StreamOptions stream;
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::mesh) continue;
    const auto found = options.arrays.find(array.name);
    const Tolerance tolerance = found == options.arrays.end() ? Tolerance{} : found->second;
    stream.arrays.push_back(
        {array.name, array.domain, array.type, array.components, array.role, array.labels, tolerance, {}});
    columns.push_back(&array);
  }
  step.arrays = stream.arrays;
  MAILLE_CHECK(check_arrays(step.arrays));
  ArrayMapsList maps = MAILLE_TRY(choose_stream_maps(mesh, stream));
  step.maps.assign(maps.maps.begin() + 1, maps.maps.end());
  step.bounds.assign(maps.bounds.begin() + 1, maps.bounds.end());
  MeshValues values(std::move(columns));
  StepOptions step_options;
  step_options.executor = options.executor;
  return append(path, std::move(step), values, step_options, Counts{mesh.point_count(), mesh.cell_count()});
}

namespace {

/// A large file whose end tells nothing is looked through from the front by FileReader.
Result<> check_end(const Source& source) {
  if (source.size() < 2 * indexed_file_bytes) return {};
  std::vector<std::byte> end(footer_bytes);
  MAILLE_CHECK(source.read_at(source.size() - footer_bytes, end));
  const auto footer = read_footer(end);
  if (footer && footer->index_offset != 0) {
    const auto records = read_index(source, *footer);
    if (records) return {};
    if (records.error().code != ErrorCode::corrupt) return tl::unexpected(records.error());
  }
  return failure(ErrorCode::corrupt,
                 source.name() + ": its end is damaged, so it does not tell which steps of time it has");
}

}  // namespace

Result<std::vector<StreamStep>> list_steps(const Source& source, bool search) {
  if (!search) MAILLE_CHECK(check_end(source));
  const FileReader file = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  if (file.header().mode != Mode::stream) return std::vector<StreamStep>{};
  const StreamHeader mesh = MAILLE_TRY(header_of(file));
  std::vector<StreamStep> steps;
  for (StepHeader& header : MAILLE_TRY(read_steps(file, mesh.description.arrays)))
    steps.push_back({header.time, std::move(header.arrays), 0});
  for (const ChunkRecord& record : file.records()) {
    const std::string_view type(record.header.type.data(), record.header.type.size());
    if ((type == "STEP" || type == "SVAL") && record.header.patch >= 1 && record.header.patch <= steps.size())
      steps[record.header.patch - 1].coded_bytes += record.header.size;
  }
  return steps;
}

}  // namespace maille
