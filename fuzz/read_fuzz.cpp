// Every reader on any bytes: the first byte chooses the format, or leaves it to the first bytes. What was
// read can be written again in every format, and compressed.

#include <maille/io.h>
#include <maille/mesh_source.h>

#include <algorithm>

#include "fuzzing.h"

namespace maille::fuzzing {
namespace {

void write_everywhere(const Mesh& mesh, unsigned choice) {
  WriteOptions options;
  options.format = formats()[choice % formats().size()].name;
  options.ascii = (choice & 64) != 0;
  options.big_endian = (choice & 128) != 0;
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  const auto notes = write_mesh(mesh, *sink, options);
  if (!notes) return require_kind(notes.error(), {ErrorCode::usage});
  // What we write, we read.
  const auto source = memory_source(bytes, "y");
  ReadOptions read;
  read.format = options.format;
  const auto again = read_mesh(*source, read);
  if (!again) std::fprintf(stderr, "%s: %s\n", options.format.c_str(), again.error().message.c_str());
  require(again.has_value(), "what was written can be read");
}

/// Everything, some elements at a time.
void read_in_parts(const Source& source) {
  const auto opened = open_mesh_source(source, {uint64_t{16} << 20});
  if (!opened) return;
  MeshSource& mesh = **opened;
  const MeshDescription& description = mesh.description();
  require(description.points <= source.size() && description.cells <= source.size(),
          "no more elements than bytes");
  constexpr uint64_t step = 100;
  std::vector<std::byte> room;
  CellPiece cells;
  for (uint64_t first = 0; first < description.cells; first += step) {
    if (!mesh.read_cells(first, std::min(step, description.cells - first), cells)) break;
    for (const uint64_t point : cells.connectivity)
      require(point < description.points, "a point that is there");
  }
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    const Array& array = description.arrays[i];
    const uint64_t count = std::min(step, description.count_of(array));
    room.resize(count * array.tuple_size());
    (void)mesh.read_array(i, 0, count, room);
  }
}

void run(unsigned choice, Bytes input) {
  const auto source = memory_source(input, "x");
  read_in_parts(*source);
  ReadOptions options;
  options.limits.mesh_bytes = uint64_t{16} << 20;
  const size_t format = choice % (formats().size() + 1);
  if (format < formats().size()) options.format = formats()[format].name;
  const auto result = read_mesh(*source, options);
  if (!result) {
    require_kind(result.error(), {ErrorCode::malformed_input, ErrorCode::unsupported, ErrorCode::memory_bound,
                                  ErrorCode::usage, ErrorCode::cannot_read});
    return;
  }
  require(validate(result->mesh).has_value(), "a mesh that was read is valid");
  if (input.size() < 2000) write_everywhere(result->mesh, choice / 9 + (choice & 0xc0));
}

}  // namespace
}  // namespace maille::fuzzing

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size > 0) maille::fuzzing::run(data[0], std::as_bytes(std::span(data, size)).subspan(1));
  return 0;
}
