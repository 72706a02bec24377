// Values of later times are appended to a file. docs/format.md, 16.9.
#include "volume/stream/append_step.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/bytes.h"
#include "base/result.h"
#include "volume/pieces/pieces_steps.h"
#include "volume/stream/mesh_stream.h"
#include "volume/stream/numbered_arrays.h"
#include "volume/stream/step_chain.h"
#include "volume/stream/step_partners.h"
#include "volume/stream/step_writer.h"
#include "volume/stream/stream_file.h"
#include "volume/stream/time_steps.h"

namespace maille {
namespace {

struct Counts {
  uint64_t points, cells;
};

/// Values of a mesh whose cells and points stand in another order in the stream: numbers are turned from
/// those of the stream into those of the input.
class InOrderOfStream final : public StepSource {
 public:
  InOrderOfStream(StepSource& values, const InputOrder& order, std::vector<StreamArray> arrays)
      : values_(values),
        points_(inverse(order.points)),  // permutations, as decode_order() has checked
        cells_(inverse(order.cells)),
        arrays_(std::move(arrays)) {}
  Result<> read(size_t array, uint64_t number, std::byte* out) override {
    const auto& input = arrays_[array].domain == Domain::point ? points_ : cells_;
    if (number >= input.size())
      return failure(ErrorCode::corrupt, "a point or cell that the order does not name");
    return values_.read(array, input[number], out);
  }

 private:
  StepSource& values_;
  std::vector<uint32_t> points_, cells_;
  std::vector<StreamArray> arrays_;
};

/// In the order of the mesh: marks arrays whose numbers are those of the mesh's numbered arrays. They take no
/// bytes then, and need no partner.
Result<> find_same_numbers(const StreamHeader& mesh, const StreamTail& tail, StepSource& values,
                           StepHeader& step) {
  step.codings.resize(step.arrays.size());
  for (const NumberedArray& numbered : mesh.description.numbered) {
    const StreamArray& known = mesh.description.arrays[numbered.array];
    const RisingNumbers numbers(numbered, known.type);
    const uint64_t count = known.domain == Domain::point ? tail.points : tail.cells;
    for (size_t i = 0; i < step.arrays.size(); ++i) {
      if (step.arrays[i].name != known.name || !are_alike(step.arrays[i], known)) continue;
      bool same = true;
      for (uint64_t k = 0; k < count && same; ++k) {
        std::array<std::byte, 8> expected{}, found{};
        numbers.store(k, expected.data());
        MAILLE_CHECK(values.read(i, k, found.data()));
        same = expected == found;
      }
      if (same) step.codings[i] = {StepCoding::as_mesh, static_cast<uint32_t>(numbered.array)};
    }
  }
  return {};
}

/// Compares the next step with those before and writes it. `open_sink` opens a sink for what stands behind
/// the file, only when the step before was read: the file may be the same.
template <class OpenSink>
Result<StepReport> add_step(const Source& source, const FileReader& file, const StreamHeader& mesh,
                            StepHeader step, StepSource& values, const StepOptions& options,
                            OpenSink open_sink) {
  const uint64_t number = count_steps(file) + 1;
  step.errors.resize(step.arrays.size());
  const auto partners = MAILLE_TRY(compare_with_earlier(source, mesh, number, step, values, options));
  const std::unique_ptr<Sink> sink = MAILLE_TRY(open_sink());
  // The digest goes on over the chunks that are there, so that the new footer vouches for the whole file.
  FileWriter writer = FileWriter::resume(*sink, file.end(), file.digest());
  const StepReport report =
      MAILLE_TRY(write_step(file, mesh, step, number, partners, values, options, std::move(writer)));
  MAILLE_CHECK(sink->commit());
  return report;
}

/// The same where values are in the order of the input.
template <class OpenSink>
Result<StepReport> write_in_order(const Source& source, const FileReader& file, const StreamHeader& mesh,
                                  StepHeader step, StepSource& values, const StepOptions& options,
                                  OpenSink open_sink) {
  const auto order = MAILLE_TRY(input_order_of(source, options.limits));
  if (!order) return add_step(source, file, mesh, std::move(step), values, options, open_sink);
  InOrderOfStream reordered(values, *order, step.arrays);
  return add_step(source, file, mesh, std::move(step), reordered, options, open_sink);
}

/// `counts`: of what the values are of, if known.
Result<StepReport> append(const std::string& path, StepHeader step, StepSource& values,
                          const StepOptions& options, const std::optional<Counts>& counts) {
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(path));
  const StepTarget target = MAILLE_TRY(open_for_step(*source, step));
  const StreamHeader& mesh = target.mesh;
  const StreamTail& tail = target.tail;
  const FileReader& file = *target.file;
  if (counts) MAILLE_CHECK(check_counts(*source, target, counts->points, counts->cells));
  MAILLE_CHECK(find_same_numbers(mesh, tail, values, step));
  MAILLE_CHECK(set_metadata(file, mesh, options, step));
  if ((file.header().required_features & in_pieces_feature) != 0) {
    step.errors.resize(step.arrays.size());
    return append_to_pieces(path, *source, file, std::move(step), values, options);
  }
  return write_in_order(*source, file, mesh, std::move(step), values, options,
                        [&] { return append_sink(path, file.end()); });
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

// All that can be refused is refused before a byte is written. A mesh in any order has no steps: nobody could
// say which point is which.
Result<StepTarget> open_for_step(const Source& source, const StepHeader& step) {
  const auto refused = [&](const std::string& what) {
    return failure(ErrorCode::usage, source.name() + ": " + what);
  };
  if (!std::isfinite(step.time)) return refused("the time of a step has to be a finite number");
  MAILLE_CHECK(check_stream_arrays(step.arrays, "step"));
  StepTarget target;
  target.file = std::make_unique<FileReader>(MAILLE_TRY(FileReader::open(source, stream_chunk_types)));
  const FileReader& file = *target.file;
  MAILLE_CHECK(file.check_complete());
  if (file.header().mode != Mode::stream)
    return refused("steps can be appended to files of mode \"stream\" only");
  target.mesh = MAILLE_TRY(header_of(file, {}));
  if (target.mesh.description.any_order && !target.mesh.description.order_apart) {
    return refused(
        "was compressed in any order, so values of later steps do not know their points; compress it "
        "without --any-order");
  }
  target.tail = MAILLE_TRY(tail_of(file, plain_memory({})));
  return target;
}

Result<> check_counts(const Source& source, const StepTarget& target, uint64_t points, uint64_t cells) {
  const StreamTail& tail = target.tail;
  if (points == tail.points && cells == tail.cells) return {};
  return failure(ErrorCode::usage, source.name() + ": has " + std::to_string(tail.points) + " points and " +
                                       std::to_string(tail.cells) + " cells, the step has " +
                                       std::to_string(points) + " and " + std::to_string(cells));
}

// Metadata like those of the mesh are left out; others are told by the list before. A damaged list before is
// no reason against the step: all of it is told then.
Result<> set_metadata(const FileReader& file, const StreamHeader& mesh, const StepOptions& options,
                      StepHeader& step) {
  if (!options.metadata || *options.metadata == mesh.description.metadata) return {};
  const uint64_t number = count_steps(file) + 1;
  const bool by_itself = number % key_steps == 0;
  const auto before = by_itself ? mesh.description.metadata : metadata_of_step(file, mesh, number - 1);
  if (!before && before.error().code != ErrorCode::corrupt) return tl::unexpected(before.error());
  step.metadata = entries_of(*options.metadata, before.value_or(Metadata()));
  return {};
}

/// For pieces, whose files are within a file: what would be appended is returned.
Result<std::vector<std::byte>> step_behind(const Source& stream, StepHeader step, StepSource& values,
                                           const StepOptions& options, StepReport& report) {
  const FileReader file = MAILLE_TRY(FileReader::open(stream, stream_chunk_types));
  const StreamHeader mesh = MAILLE_TRY(header_of(file, {}));
  std::vector<std::byte> bytes;
  report = MAILLE_TRY(write_in_order(stream, file, mesh, std::move(step), values, options,
                                     [&]() -> Result<std::unique_ptr<Sink>> { return memory_sink(bytes); }));
  return bytes;
}

// Maps follow from the declarations alone, as values are read once.
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
    stream.arrays.push_back({array.name,
                             array.domain,
                             array.type,
                             array.components,
                             array.role,
                             array.labels,
                             tolerance_of(options, array.name),
                             {}});
    columns.push_back(&array);
  }
  step.arrays = stream.arrays;
  MAILLE_CHECK(check_stream_arrays(step.arrays, "step"));
  ArrayMapsList maps = MAILLE_TRY(choose_stream_maps(mesh, stream));
  step.maps.assign(maps.maps.begin() + 1, maps.maps.end());
  step.bounds.assign(maps.bounds.begin() + 1, maps.bounds.end());
  MeshValues values(std::move(columns));
  StepOptions step_options;
  step_options.executor = options.executor;
  if (!mesh.metadata.empty()) step_options.metadata = mesh.metadata;
  return append(path, std::move(step), values, step_options, Counts{mesh.point_count(), mesh.cell_count()});
}

}  // namespace maille
