#include "random/chart_codec.h"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>

#include "base/bytes.h"
#include "base/result.h"

namespace maille {
namespace {

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("chart: ") + what);
}

bool has_varying_cells(std::span<const CellBlock> blocks) {
  return std::any_of(blocks.begin(), blocks.end(),
                     [](const CellBlock& block) { return nodes_of(block.type) == 0; });
}
bool has_varying_cells(std::span<const CodedBlock> blocks) {
  return std::any_of(blocks.begin(), blocks.end(),
                     [](const CodedBlock& block) { return nodes_of(block.shape.type) == 0; });
}

/// Sizes that a description leaves open; corners where they do not follow from cells.
void put_counts(ByteWriter& out, const ChartCounts& counts, size_t blocks) {
  out.put_count(counts.points);
  put_block_cells(counts.cells, blocks, [&](uint64_t count) { out.put_count(count); });
  if (counts.corners) out.put_count(*counts.corners);
}

/// The blocks of a chart, and how many cells they have. Nothing where they make no sense.
std::optional<std::vector<BlockCells>> get_blocks(ByteReader& in, size_t blocks) {
  std::vector<BlockCells> cells;
  const auto add = [&](uint32_t block, uint64_t count) {
    cells.push_back({block, count});
    // Each count is below 2^32 before it is multiplied or added, so that no sum of the blocks can wrap.
    return count < max_points;
  };
  const auto get = [&] { return in.get_count(); };
  if (!get_block_cells(
          blocks, get, [&] { return in.ok(); }, add))
    return std::nullopt;
  return cells;
}

Result<Description> get_sizes(ByteReader& in, const ChartSet& set) {
  const uint64_t points = in.get_count();
  const auto blocks = get_blocks(in, set.blocks.size());
  if (!blocks) return corrupt("sizes that are none");
  Description description = set.description;
  description.blocks = blocks_of_part(set.blocks, *blocks);
  uint64_t corners = 0;
  for (const CodedBlock& block : description.blocks)
    corners += block.shape.cells * nodes_of(block.shape.type);
  if (has_varying_cells(description.blocks)) corners = in.get_count();
  if (!in.ok() || points > max_points || description.cells() >= max_points)
    return corrupt("sizes that are none");
  description.corners = corners;
  description.points = static_cast<uint32_t>(points);
  return description;
}

/// The streams of a chart, by their place behind each other.
class ChartStreams final : public StreamSource {
 public:
  Result<> read(ByteReader& in, size_t arrays) {
    const uint64_t codings = in.get_count();
    if (codings > 0xff) return corrupt("coded in an unknown way");
    topology_ = static_cast<uint32_t>(codings & 0xf);
    positions_ = static_cast<uint32_t>(codings >> 4);
    // The last has what the others leave.
    std::vector<uint64_t> sizes(arrays + 1);
    for (uint64_t& size : sizes) size = in.get_count();
    for (const uint64_t size : sizes) streams_.push_back(in.get_bytes(size));
    if (!in.ok()) return corrupt("streams that are not whole");
    streams_.push_back(in.get_bytes(in.remaining()));
    return {};
  }
  bool has_stream(const StreamKey& key) const override { return find(key) != nullptr; }
  Result<std::vector<std::byte>> read_stream(const StreamKey& key) const override {
    const Bytes* stream = find(key);
    if (stream == nullptr) return corrupt("a stream is missing");
    // From pointers: with iterators some libraries copy byte by byte.
    return std::vector<std::byte>(stream->data(), stream->data() + stream->size());
  }

 private:
  const Bytes* find(const StreamKey& key) const {
    const std::string_view type = key.type;
    if (type == "TOPO") return key.number == topology_ ? &streams_[0] : nullptr;
    if (type == "POSI") return key.number == positions_ ? &streams_[1] : nullptr;
    return type == "ARRY" && key.number + size_t{2} < streams_.size() ? &streams_[key.number + size_t{2}]
                                                                      : nullptr;
  }

  uint32_t topology_ = 0, positions_ = 0;
  std::vector<Bytes> streams_;
};

/// Coarse charts have either all arrays or those of points alone.
Result<> keep_arrays(Description& chart, uint64_t count) {
  if (count == chart.arrays.size() + 1) return {};
  std::erase_if(chart.arrays, [](const ArrayDescription& array) { return array.domain != Domain::point; });
  if (count == chart.arrays.size() + 1) return {};
  return corrupt("another number of arrays than the mesh has");
}

/// glibc's heap gives memory back as soon as 128 KiB of it are free, or twice the largest block that had
/// pages of its own and was freed (mallopt(3)). A block of 4 MiB, which nothing touches, makes that 8 MiB:
/// more than a chart with arrays takes. So the next chart gets the same pages instead of new ones, which
/// takes half of the time for helmet (texture coordinates and normals).
bool keep_freed_memory() {
#ifdef __GLIBC__
  void* volatile memory = std::malloc(size_t{4} << 20);
  std::free(memory);
#endif
  return true;
}

Description chart_description(const Description& file, bool finest) {
  Description chart;
  chart.effort = file.effort;
  chart.memory = file.memory;
  chart.positions = file.positions;
  for (const ArrayDescription& array : file.arrays) {
    if (!finest && array.domain == Domain::mesh) continue;
    chart.arrays.push_back(array);
    chart.arrays.back().mesh_tuples = 0;
  }
  return chart;
}

}  // namespace

std::vector<ArrayToCode> arrays_of_level(std::span<const ArrayToCode> arrays, uint32_t level) {
  std::vector<ArrayToCode> chosen;
  for (const ArrayToCode& coded : arrays) {
    if (level == 0 || coded.array->domain != Domain::mesh) chosen.push_back(coded);
  }
  return chosen;
}

Result<ChartSet> chart_set(const Description& file, uint32_t set, Bytes tables) {
  ChartSet result;
  result.finest = set == 0;
  result.description = chart_description(file, result.finest);
  if (result.finest) {
    result.blocks = file.blocks;
  } else {
    result.blocks.push_back({"", {CellType::triangle, 0}});
  }
  if (tables.empty()) return result;
  result.tables = MAILLE_TRY(SharedFanTables::read(tables, file.positions.type));
  return result;
}

ChartCounts counts_of(const MeshPart& part) {
  ChartCounts counts{part.mesh.point_count(), part.cells_by_block(), {}};
  if (has_varying_cells(part.mesh.blocks)) counts.corners = part.mesh.corner_count();
  return counts;
}

std::vector<std::byte> chart_bytes(const ChartCounts& counts, size_t blocks, const EncodedPatch& patch,
                                   std::optional<std::span<const SharedPoint>> shared) {
  ByteWriter out;
  put_counts(out, counts, blocks);
  std::vector<Bytes> streams{patch.topology.bytes};
  for (const CodedStream& stream : patch.arrays) streams.push_back(stream.bytes);
  if (shared) put_section(out, encode_shared(*shared, static_cast<uint32_t>(counts.points), patch.border));
  if (!shared) out.put_count(patch.arrays.size());
  out.put_count(patch.topology.key.number | patch.arrays[0].key.number << 4);
  for (size_t i = 0; i + 1 < streams.size(); ++i) out.put_count(streams[i].size());
  for (const Bytes stream : streams) out.put_bytes(stream);
  return out.take();
}

namespace {

/// A chart that is not decoded yet.
struct OpenChart {
  Description description;
  Bytes shared;
  ChartStreams streams;
};
Result<OpenChart> open_chart(const ChartSet& set, Bytes bytes) {
  ByteReader in(bytes);
  OpenChart chart;
  chart.description = MAILLE_TRY(get_sizes(in, set));
  if (!set.finest) MAILLE_CHECK(keep_arrays(chart.description, in.get_count()));
  if (set.finest) chart.shared = in.get_bytes(in.get_count());
  MAILLE_CHECK(chart.streams.read(in, chart.description.arrays.size()));
  return chart;
}

}  // namespace

Result<> add_claimed_memory(const ChartSet& set, Bytes bytes, PatchesMemory& memory) {
  const OpenChart chart = MAILLE_TRY(open_chart(set, bytes));
  memory.add_patch(chart.description, static_cast<double>(bytes.size()), is_of_front(chart.streams, 1));
  return {};
}

Result<DecodedChart> decode_chart(const ChartSet& set, Bytes bytes, const DecodeOptions& options,
                                  FanBuffers* buffers, ChartUse use) {
  // Once, where one chart comes after the other.
  if (buffers != nullptr) {
    [[maybe_unused]] static const bool kept = keep_freed_memory();
  }
  const OpenChart open = MAILLE_TRY(open_chart(set, bytes));
  const Description& description = open.description;
  const SharedFanTables* tables = set.tables.fans ? &set.tables : nullptr;
  // Not patch 0: arrays of the mesh as a whole are not in charts.
  DecodedPatch patch = MAILLE_TRY(decode_patch(open.streams, description, 1, options, tables, buffers));
  DecodedChart chart;
  chart.mesh = std::move(patch.mesh);
  chart.block_numbers = description.block_numbers();
  if (!patch.known_valid) {
    if (auto valid = validate(chart.mesh); !valid)
      return failure(ErrorCode::corrupt, std::move(valid).error().message);
  }
  if (set.finest && use == ChartUse::join)
    chart.shared = MAILLE_TRY(decode_shared(open.shared, description.points, points_on_borders(chart.mesh)));
  return chart;
}

}  // namespace maille
