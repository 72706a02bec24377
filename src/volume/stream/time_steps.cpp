// Steps of time behind a mesh: how many there are, and what their headers say. docs/format.md, 16.9.
#include "volume/stream/time_steps.h"

#include <algorithm>

#include "base/named_error.h"
#include "base/result.h"
#include "container/chunk_finder.h"

namespace maille {

Result<StreamHeader> header_of(const FileReader& file, const Limits& limits) {
  return with_name(decode_header(MAILLE_TRY(file.read_stream({"DESC"})), plain_memory(limits)), file.name());
}

Result<StreamTail> tail_of(const FileReader& file, uint64_t most_memory) {
  return with_name(decode_tail(MAILLE_TRY(file.read_stream({"TAIL"})), most_memory), file.name());
}

/// Each look-up goes to the index of the file, so that no step is read.
uint64_t count_steps(const FileReader& file) {
  uint64_t count = 0;
  while (count < UINT32_MAX && file.has_stream({"STEP", static_cast<uint32_t>(count + 1), 0})) ++count;
  return count;
}

void set_time(double time, std::vector<Array>& mesh_arrays) {
  for (Array& array : mesh_arrays) {
    if (array.name == "TimeValue" && array.type == Scalar::f64 && array.count() == 1)
      store(array.bytes.data(), time);
  }
}

Result<> check_step(uint64_t step, uint64_t steps, const std::string& name) {
  if (step <= steps) return {};
  return failure(ErrorCode::usage, name + ": has no step " + std::to_string(step) + "; the last one is " +
                                       std::to_string(steps));
}

Result<std::vector<StepHeader>> read_steps(const FileReader& file, const std::vector<StreamArray>& arrays,
                                           const Limits& limits) {
  // A source whose bytes arrive later is asked for all of them before the first that is missing is an error.
  std::vector<Result<std::vector<std::byte>>> streams;
  const uint64_t count = count_steps(file);
  for (uint32_t i = 1; i <= count; ++i) streams.push_back(file.read_stream({"STEP", i, 0}));
  std::vector<StepHeader> steps;
  uint64_t left = plain_memory(limits);
  for (auto& stream : streams) {
    steps.push_back(MAILLE_TRY(decode_step(MAILLE_TRY(std::move(stream)), arrays, left)));
    left -= steps.back().memory;
  }
  return steps;
}

namespace {

/// Whether each array of the mesh is there, with the mesh's own values.
bool repeats(const StepHeader& step, const std::vector<StreamArray>& arrays) {
  for (size_t i = 0; i < arrays.size(); ++i) {
    const auto is_it = [&](size_t k) {
      return step.codings[k].method == StepCoding::as_mesh && step.codings[k].of == i &&
             step.arrays[k].name == arrays[i].name;
    };
    size_t k = 0;
    while (k < step.arrays.size() && !is_it(k)) ++k;
    if (k == step.arrays.size()) return false;
  }
  return true;
}

/// A large file whose end tells nothing would be looked through from the front by FileReader, which takes as
/// long as reading it; who lists steps is told instead.
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

// Bytes of a step are those of all its chunks, by the records of the file.
Result<std::vector<StreamStep>> steps_of(const FileReader& file, const StreamHeader& mesh,
                                         const Limits& limits) {
  const std::vector<StreamArray>& arrays = mesh.description.arrays;
  std::vector<StreamStep> steps;
  for (StepHeader& header : MAILLE_TRY(read_steps(file, arrays, limits))) {
    const bool repeated = repeats(header, arrays);
    steps.push_back({header.time, std::move(header.arrays), std::move(header.errors), 0, repeated});
  }
  for (const ChunkRecord& record : file.records()) {
    const std::string_view type(record.header.type.data(), record.header.type.size());
    if ((type == "STEP" || type == "SVAL" || type == "SIDX") && record.header.patch >= 1 &&
        record.header.patch <= steps.size())
      steps[record.header.patch - 1].coded_bytes += record.header.size;
  }
  return steps;
}

Result<std::vector<StreamStep>> list_steps(const Source& source, bool search, const Limits& limits) {
  if (!search) MAILLE_CHECK(check_end(source));
  const FileReader file = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  if (file.header().mode != Mode::stream) return std::vector<StreamStep>{};
  // What is missing may be the head of a step: those before it would pass for all.
  MAILLE_CHECK(file.check_complete());
  return with_name(steps_of(file, MAILLE_TRY(header_of(file, limits)), limits), file.name());
}

}  // namespace maille
