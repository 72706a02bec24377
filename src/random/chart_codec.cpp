#include "random/chart_codec.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <string>
#include <string_view>

#include "base/bytes.h"
#include "base/result.h"
#include "entropy/bit_model.h"
#include "entropy/integer_model.h"
#include "entropy/rans.h"

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
void put_sizes(ByteWriter& out, const Mesh& part) {
  out.put_count(part.point_count());
  for (const CellBlock& block : part.blocks) out.put_count(block.size());
  if (has_varying_cells(part.blocks)) out.put_count(part.corner_count());
}

Result<Description> get_sizes(ByteReader& in, Description description) {
  const uint64_t points = in.get_count();
  uint64_t cells = 0, corners = 0;
  for (CodedBlock& block : description.blocks) {
    block.shape.cells = in.get_count();
    if (block.shape.cells >= max_points) return corrupt("sizes that are none");
    cells += block.shape.cells;
    corners += block.shape.cells * nodes_of(block.shape.type);
  }
  if (has_varying_cells(description.blocks)) corners = in.get_count();
  if (!in.ok() || points > max_points || cells >= max_points) return corrupt("sizes that are none");
  description.corners = corners;
  description.points = static_cast<uint32_t>(points);
  return description;
}

/// Points on edges of one face (of any odd number), up to chance, rising: the neighbours along faces' sides
/// cancel where each side is there twice. `number` gives the coded number of a point.
template <class Number>
std::vector<uint32_t> points_on_borders(const Mesh& mesh, Number number) {
  std::vector<uint32_t> neighbours(mesh.point_count());
  // Number 0 must count, too.
  const auto coded = [&](uint32_t point) { return number(point) + 1; };
  const auto add = [&](uint32_t before, uint32_t at, uint32_t next) { neighbours[at - 1] ^= before ^ next; };
  for (const CellBlock& block : mesh.blocks) {
    const std::vector<uint32_t>& corners = block.connectivity;
    for (size_t i = 0; block.type == CellType::triangle && i + 2 < corners.size(); i += 3) {
      const uint32_t a = coded(corners[i]), b = coded(corners[i + 1]), c = coded(corners[i + 2]);
      add(a, b, c);
      add(b, c, a);
      add(c, a, b);
    }
    for (uint64_t i = 0; block.type != CellType::triangle && i < block.size(); ++i) {
      const auto cell = block.cell(i);
      for (size_t k = 0; k < cell.size(); ++k)
        add(coded(cell[k > 0 ? k - 1 : cell.size() - 1]), coded(cell[k]),
            coded(cell[k + 1 < cell.size() ? k + 1 : 0]));
    }
  }
  std::vector<uint32_t> border;
  // Few are not 0.
  const auto count = static_cast<uint32_t>(neighbours.size());
  for (uint32_t i = 0; i < count; ++i) {
    for (uint64_t four[2]; i + 4 <= count; i += 4) {
      std::memcpy(four, &neighbours[i], sizeof four);
      if ((four[0] | four[1]) != 0) break;
    }
    if (i < count && neighbours[i] != 0) border.push_back(i);
  }
  return border;
}

/// Which points are shared, from where the chart's borders are: nearly all on borders, few elsewhere. One
/// function for both directions; a decoder's `shared` is filled. False: they do not fit.
template <class Coder>
bool code_shared(Coder& coder, uint32_t points, const std::vector<uint32_t>& border,
                 std::vector<SharedPoint>& shared, bool decoding) {
  std::vector<uint32_t> here, elsewhere;
  if (!decoding) {
    for (const SharedPoint& point : shared)
      (std::binary_search(border.begin(), border.end(), point.point) ? here : elsewhere)
          .push_back(point.point);
  }
  CountModel number, step;
  const uint32_t count = number.code(coder, static_cast<uint32_t>(elsewhere.size()));
  if (count > points) return false;
  uint64_t next = 0;
  for (uint32_t i = 0; i < count; ++i) {
    if (decoding) elsewhere.push_back(static_cast<uint32_t>(next));
    next += step.code(coder, elsewhere[i] - static_cast<uint32_t>(next));
    if (next >= points) return false;
    elsewhere[i] = static_cast<uint32_t>(next++);
  }
  // A border of the mesh itself is in long runs.
  std::array<BitModel, 2> there;
  bool before = true;
  size_t at = 0;
  for (const uint32_t point : border) {
    before = there[before].code(coder, at < here.size() && here[at] == point);
    if (decoding && before) here.push_back(point);
    at += before;
  }
  if (decoding) {
    here.insert(here.end(), elsewhere.begin(), elsewhere.end());
    std::sort(here.begin(), here.end());
    here.erase(std::unique(here.begin(), here.end()), here.end());
    for (const uint32_t point : here) shared.push_back({point, 0});
  }
  // So are copies, where a lattice is too coarse for the mesh.
  std::array<CountModel, 2> copy;
  bool copied = false;
  for (SharedPoint& point : shared) {
    point.copy = copy[copied].code(coder, point.copy);
    copied = point.copy != 0;
  }
  return true;
}

/// No bytes where all points on borders are shared, no others, and there are no copies.
std::vector<std::byte> encode_shared(std::span<const SharedPoint> shared, uint32_t points,
                                     const std::vector<uint32_t>& border) {
  const auto is_plain = [](const SharedPoint& point, uint32_t on_border) {
    return point.point == on_border && point.copy == 0;
  };
  if (std::equal(shared.begin(), shared.end(), border.begin(), border.end(), is_plain)) return {};
  std::vector<SharedPoint> all(shared.begin(), shared.end());
  RansEncoder encoder;
  code_shared(encoder, points, border, all, false);
  return encoder.finish();
}

Result<std::vector<SharedPoint>> decode_shared(Bytes bytes, uint32_t points,
                                               const std::vector<uint32_t>& border) {
  std::vector<SharedPoint> shared;
  if (bytes.empty()) {
    for (const uint32_t point : border) shared.push_back({point, 0});
    return shared;
  }
  RansDecoder decoder(bytes);
  if (!code_shared(decoder, points, border, shared, true) || decoder.exhausted())
    return corrupt("shared points that are not there");
  return shared;
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

/// As the decoder will see it: points of `part` are those of the coded ones in the order of the whole mesh.
std::vector<uint32_t> borders_of_coded(const Mesh& part, const PatchSources& sources) {
  std::vector<uint32_t> coded_as(sources.points.size());
  std::iota(coded_as.begin(), coded_as.end(), 0u);
  std::sort(coded_as.begin(), coded_as.end(),
            [&](uint32_t a, uint32_t b) { return sources.points[a] < sources.points[b]; });
  return points_on_borders(part, [&](uint32_t point) { return coded_as[point]; });
}

/// Coarse charts have either all arrays or those of points alone.
Result<> keep_arrays(Description& chart, uint64_t count) {
  if (count == chart.arrays.size() + 1) return {};
  std::erase_if(chart.arrays, [](const ArrayDescription& array) { return array.domain != Domain::point; });
  if (count == chart.arrays.size() + 1) return {};
  return corrupt("another number of arrays than the mesh has");
}

}  // namespace

Description chart_description(const Description& file, uint32_t level) {
  Description chart;
  chart.effort = file.effort;
  chart.positions = file.positions;
  for (const ArrayDescription& array : file.arrays) {
    if (level > 0 && array.domain == Domain::mesh) continue;
    chart.arrays.push_back(array);
    chart.arrays.back().mesh_tuples = 0;
  }
  if (level == 0) {
    chart.blocks = file.blocks;
  } else {
    chart.blocks.push_back({"", {CellType::triangle, 0}});
  }
  return chart;
}

std::vector<ArrayToCode> arrays_of_level(std::span<const ArrayToCode> arrays, uint32_t level) {
  std::vector<ArrayToCode> chosen;
  for (const ArrayToCode& coded : arrays) {
    if (level == 0 || coded.array->domain != Domain::mesh) chosen.push_back(coded);
  }
  return chosen;
}

Result<ChartSet> chart_set(const Description& file, uint32_t set, Bytes tables) {
  ChartSet result{chart_description(file, set), set == 0, {}};
  if (tables.empty()) return result;
  result.tables = MAILLE_TRY(SharedFanTables::read(tables, file.positions.type));
  return result;
}

std::vector<std::byte> chart_bytes(const Mesh& part, const EncodedPatch& patch,
                                   std::optional<std::span<const SharedPoint>> shared) {
  ByteWriter out;
  put_sizes(out, part);
  std::vector<Bytes> streams{patch.topology.bytes};
  for (const CodedStream& stream : patch.arrays) streams.push_back(stream.bytes);
  if (shared)
    put_section(out, encode_shared(*shared, static_cast<uint32_t>(part.point_count()),
                                   borders_of_coded(part, patch.sources)));
  if (!shared) out.put_count(patch.arrays.size());
  out.put_count(patch.topology.key.number | patch.arrays[0].key.number << 4);
  for (size_t i = 0; i + 1 < streams.size(); ++i) out.put_count(streams[i].size());
  for (const Bytes stream : streams) out.put_bytes(stream);
  return out.take();
}

Result<double> claimed_bytes(const Description& described, Bytes bytes) {
  ByteReader in(bytes);
  return memory_of(MAILLE_TRY(get_sizes(in, described)));
}

Result<DecodedChart> decode_chart(const ChartSet& set, Bytes bytes, const DecodeOptions& options,
                                  FanBuffers* buffers, ChartUse use) {
  ByteReader in(bytes);
  Description description = MAILLE_TRY(get_sizes(in, set.description));
  if (!set.finest) MAILLE_CHECK(keep_arrays(description, in.get_count()));
  const Bytes shared = set.finest ? in.get_bytes(in.get_count()) : Bytes();
  ChartStreams streams;
  MAILLE_CHECK(streams.read(in, description.arrays.size()));
  const SharedFanTables* tables = set.tables.fans ? &set.tables : nullptr;
  // Not patch 0: arrays of the mesh as a whole are not in charts.
  DecodedPatch patch = MAILLE_TRY(decode_patch(streams, description, 1, options, tables, buffers));
  DecodedChart chart;
  chart.mesh = std::move(patch.mesh);
  if (!patch.known_valid) {
    if (auto valid = validate(chart.mesh); !valid)
      return failure(ErrorCode::corrupt, std::move(valid).error().message);
  }
  if (set.finest && use == ChartUse::join)
    chart.shared = MAILLE_TRY(decode_shared(
        shared, description.points, points_on_borders(chart.mesh, [](uint32_t point) { return point; })));
  return chart;
}

}  // namespace maille
