#include "volume/stream/stream_file.h"

#include <algorithm>
#include <limits>

#include "base/result.h"
#include "container/file_reader.h"
#include "volume/stream/stream_layout.h"
#include "volume/stream/time_steps.h"

namespace maille {
namespace {

// The step is that of the first component: all components of an array with a bound have the same.
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

// Ranges and errors as the encoder met them. Components without a number have an empty range (infinity to
// -infinity).
void add_from_tail(const StreamTail& tail, size_t number, ArrayInfo& info) {
  if (number >= tail.ranges.size()) return;
  for (const ValueRange::Component& each : tail.ranges[number].components) {
    constexpr double none = std::numeric_limits<double>::infinity();
    info.ranges.emplace_back(each.any ? each.low : none, each.any ? each.high : -none);
  }
  info.nans = tail.ranges[number].nans;
  if (number < tail.errors.size()) info.maximum_error = tail.errors[number];
}

/// What decoding takes, about: models and buffers; slots of points, cells and values; a bit for each point
/// that is written. Measured: a front of 100,000 points takes 40 MB. The counts are those of the tail, capped
/// so that a damaged one gives no absurd number.
uint64_t decode_bytes_of(const StreamHeader& header, const StreamTail& tail) {
  constexpr uint64_t models = uint64_t{18} << 20, point_and_cell = 168, value = 16;
  uint64_t components = header.description.positions.components;
  for (const StreamArray& array : header.description.arrays) components += array.components;
  const uint64_t most =
      std::min(std::max(tail.most_live_points, tail.most_live_cells), tail.points + tail.cells);
  return models + most * (point_and_cell + value * components) + tail.points / 8;
}

// By chunks, so that sizes are right also where the file is damaged. The order apart counts as connectivity.
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

FileInfo info_of_stream(const Source& source, const FileReader& reader, const StreamHeader& header,
                        const StreamTail& tail) {
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
  // Batches, or where a file is in pieces, these: what is decoded in one go.
  info.parts = std::max<uint64_t>(tail.batches, 1);
  for (const StreamTail::Block& block : tail.blocks) {
    const std::string type = std::string("(") + name_of(block.type) + ")";
    info.blocks.emplace_back(block.name.empty() ? type : block.name + " " + type, block.cells);
  }
  info.types = tail.types;
  info.connectivity.name = "connectivity";
  info.connectivity.domain = Domain::corner;
  info.connectivity.type = Scalar::u32;
  info.connectivity.count = tail.corners;
  info.positions = info_of(header.description.positions, header.bounds[0], header.maps[0][0], tail.points);
  add_from_tail(tail, 0, info.positions);
  for (size_t i = 0; i < header.description.arrays.size(); ++i) {
    const StreamArray& array = header.description.arrays[i];
    info.arrays.push_back(info_of(array, header.bounds[i + 1], header.maps[i + 1][0],
                                  array.domain == Domain::point ? tail.points : tail.cells));
    add_from_tail(tail, i + 1, info.arrays.back());
  }
  info.time = description.time;
  info.metadata = header.description.metadata;
  info.provenance = header.description.provenance;
  info.chunks = reader.chunks();
  info.problems = reader.problems();
  return info;
}

/// Adds what is known of the steps; a step that is damaged makes all of them a problem, not an error, as the
/// mesh can still be read.
Result<> add_steps(const FileReader& file, const StreamHeader& header, const Limits& limits, FileInfo& info) {
  const auto steps = steps_of(file, header, limits);
  if (!steps && steps.error().code != ErrorCode::corrupt) return tl::unexpected(steps.error());
  for (const StreamStep& step : steps ? *steps : std::vector<StreamStep>{}) {
    StepInfo& added = info.steps.emplace_back();
    added.time = step.time;
    added.coded_bytes = step.coded_bytes;
    added.maximum_errors = step.errors;
    added.repeats_mesh = step.repeats_mesh;
    for (const StreamArray& array : step.arrays) added.arrays.push_back(array.name);
  }
  if (!steps) info.problems.push_back(steps.error().message);
  return {};
}

/// A file without an end is described as far as it goes: counts are 0 then.
Result<FileInfo> inspect_stream(const Source& source, const Limits& limits) {
  const FileReader reader = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  const StreamHeader header = MAILLE_TRY(header_of(reader, limits));
  StreamTail tail;
  if (reader.has_stream({"TAIL"})) tail = MAILLE_TRY(tail_of(reader, plain_memory(limits) - header.memory));
  FileInfo info = info_of_stream(source, reader, header, tail);
  info.most_points_in_use = tail.most_live_points;
  info.decode_bytes = decode_bytes_of(header, tail);
  add_sizes(reader, info);
  MAILLE_CHECK(add_steps(reader, header, limits, info));
  return info;
}

Result<StreamEnds> read_stream_ends(const Source& source, const Limits& limits) {
  const FileReader reader = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  if (reader.header().mode != Mode::stream)
    return failure(ErrorCode::unsupported, source.name() + ": a file of another mode than \"stream\"");
  MAILLE_CHECK(reader.check_complete());
  StreamEnds ends;
  ends.in_pieces = (reader.header().required_features & in_pieces_feature) != 0;
  ends.header = MAILLE_TRY(header_of(reader, limits));
  ends.tail = MAILLE_TRY(tail_of(reader, plain_memory(limits) - ends.header.memory));
  return ends;
}

}  // namespace maille
