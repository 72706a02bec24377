// Files of mode stream: read portion by portion from a stream that gives some bytes at a time, with their
// steps of time, salvaged, and decoded into a mesh that is written in parts. The input is a file, or, where
// it does not begin as one does, the streams of one.

#include <maille/file.h>
#include <maille/out_of_core.h>
#include <maille/stream.h>

#include <algorithm>

#include "fuzzing.h"
#include "packed_streams.h"
#include "volume/stream/mesh_from_parts.h"
#include "volume/stream/stream_file.h"

namespace maille::fuzzing {
namespace {

constexpr Limits limits{uint64_t{16} << 20};
constexpr auto fitting = {ErrorCode::corrupt, ErrorCode::unsupported, ErrorCode::memory_bound};

/// Gives one to some dozens of bytes at once, as a socket may.
class Trickle final : public ByteStream {
 public:
  explicit Trickle(Bytes bytes) : bytes_(bytes) {}
  Result<size_t> read(std::span<std::byte> out) override {
    const size_t count = std::min({out.size(), bytes_.size(), size_t{1} + step_++ * 7 % 61});
    std::copy_n(bytes_.begin(), count, out.begin());
    bytes_ = bytes_.subspan(count);
    return count;
  }
  std::string name() const override { return "x"; }

 private:
  Bytes bytes_;
  size_t step_ = 0;
};

void check(const StreamPortion& portion, const StreamDescription& description) {
  const size_t cells = portion.cell_count(), points = portion.points.size();
  require(portion.offsets.size() == cells + 1 && portion.offsets[0] == 0,
          "a portion has an offset for each cell");
  require(std::is_sorted(portion.offsets.begin(), portion.offsets.end()), "offsets ascend");
  require(portion.offsets.back() == portion.connectivity.size() &&
              portion.slots.size() == portion.connectivity.size(),
          "numbers and slots are those of all corners");
  require(portion.point_slots.size() == points, "points have slots");
  require(portion.positions.size() == points * description.positions.tuple_size(), "points have positions");
  for (const auto* slots : {&portion.slots, &portion.point_slots, &portion.ended_slots}) {
    for (const uint32_t slot : *slots) require(slot < portion.slot_count, "slots are below their count");
  }
  size_t of_points = 0, of_cells = 0;
  for (const StreamArray& array : description.arrays) {
    const bool on_points = array.domain == Domain::point;
    const auto& bytes = on_points ? portion.point_arrays[of_points++] : portion.cell_arrays[of_cells++];
    require(bytes.size() == (on_points ? points : cells) * array.tuple_size(), "arrays have all tuples");
  }
}

void read_all(Result<StreamReader> reader) {
  if (!reader) return require_kind(reader.error(), fitting);
  StreamPortion portion;
  for (uint64_t next = 0;;) {
    const auto more = reader->next(portion);
    if (!more) return require_kind(more.error(), fitting);
    if (!*more) return;
    require(portion.first_cell == next, "portions follow each other");
    check(portion, reader->description());
    next += portion.cell_count();
  }
}

void read_steps(const Source& source) {
  const auto steps = list_steps(source);
  if (!steps) return require_kind(steps.error(), {ErrorCode::corrupt, ErrorCode::unsupported});
  for (uint64_t step = 1; step <= std::min<size_t>(steps->size(), 3); ++step) {
    read_all(StreamReader::open(source, step, {.limits = limits, .any_order = true}));
    const auto mesh = decode(source, {.limits = limits, .step = step});
    if (!mesh) require_kind(mesh.error(), fitting);
    require(!mesh || validate(*mesh).has_value(), "a step is valid");
  }
}

void read_salvaged(const Source& source) {
  const auto saved = salvage(source, {.limits = limits});
  if (!saved) return require_kind(saved.error(), fitting);
  require(validate(saved->mesh).has_value(), "what is salvaged is valid");
}

void read_in_parts(const Source& source) {
  const auto mesh = describe(source, {.limits = limits});
  if (!mesh) return require_kind(mesh.error(), fitting);
  uint64_t bytes = mesh->points * 3 * size_of(mesh->point_type);
  if (mesh->points > uint64_t{1} << 20 || mesh->cells > uint64_t{1} << 20) return;
  for (const Array& array : mesh->arrays) bytes += mesh->count_of(array) * array.tuple_size();
  if (bytes > limits.mesh_bytes) return;  // the sink below is in memory
  uint64_t in_blocks = 0;
  for (const auto& block : mesh->blocks) {
    in_blocks += block.cells;
    if (block.cells > mesh->cells || in_blocks > mesh->cells) return;
  }
  if (in_blocks != mesh->cells) return;
  testing::MeshFromParts parts(*mesh);
  const auto done = decode(source, parts, {.limits = limits});
  if (!done) return require_kind(done.error(), fitting);
  const auto whole = decode(source, {.limits = limits});
  if (!whole) return require_kind(whole.error(), {ErrorCode::memory_bound, ErrorCode::corrupt});
  require(whole->points.bytes == parts.mesh.points.bytes, "in parts and whole give the same points");
}

}  // namespace
}  // namespace maille::fuzzing

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace maille;
  using namespace maille::fuzzing;
  if (size == 0) return 0;
  const Bytes input = std::as_bytes(std::span(data, size));
  const std::vector<std::byte> packed =
      data[0] == 0x89 ? std::vector<std::byte>() : file_of_streams(input, Mode::stream);
  const Bytes file = data[0] == 0x89 ? input : Bytes(packed);
  const auto source = memory_source(file, "x.maille");
  if (const auto info = inspect(*source); !info)
    require_kind(info.error(), {ErrorCode::corrupt, ErrorCode::unsupported, ErrorCode::memory_bound});
  // One way each: most of the time goes into making readers, whose models take some 18 MB.
  switch (size % 4) {
    case 0:
      read_steps(*source);
      break;
    case 1:
      read_salvaged(*source);
      break;
    case 2:
      read_all(StreamReader::open(std::make_unique<Trickle>(file), {.limits = limits, .any_order = true}));
      break;
    default:
      read_in_parts(*source);
  }
  return 0;
}
