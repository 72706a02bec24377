#include "hierarchy/chart_codec.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <string_view>

#include "base/bytes.h"
#include "base/result.h"
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

/// Points on edges of one face (of any odd number), up to chance: all neighbours along faces' sides cancel
/// where each side is there twice. `number` gives the coded number of a point.
template <class Number>
std::vector<bool> points_on_borders(const Mesh& mesh, Number number) {
  std::vector<uint32_t> neighbours(mesh.point_count());
  const auto add = [&](std::span<const uint32_t> cell) {
    for (size_t k = 0; k < cell.size(); ++k) {
      const uint32_t point = number(cell[k]);
      const uint32_t next = number(cell[k + 1 == cell.size() ? 0 : k + 1]);
      // Number 0 must count, too.
      neighbours[point] ^= next + 1;
      neighbours[next] ^= point + 1;
    }
  };
  for (const CellBlock& block : mesh.blocks) {
    if (block.type == CellType::triangle) {
      for (size_t i = 0; i < block.connectivity.size(); i += 3)
        add(std::span(block.connectivity).subspan(i, 3));
    } else {
      for (uint64_t i = 0; i < block.size(); ++i) add(block.cell(i));
    }
  }
  std::vector<bool> border(neighbours.size());
  for (size_t i = 0; i < border.size(); ++i) border[i] = neighbours[i] != 0;
  return border;
}

/// The points on borders that are not shared, those elsewhere that are, and copies that are not the first.
struct SharedExceptions {
  std::vector<uint32_t> points;
  std::vector<SharedPoint> copies;

  template <class Coder>
  void code(Coder& coder, uint32_t most_points, bool& fits) {
    auto count = static_cast<uint32_t>(points.size());
    CountModel number, step, copy;
    count = number.code(coder, count);
    fits = count <= most_points;
    uint64_t next = 0;
    for (uint32_t i = 0; i < count && fits; ++i) {
      if (i == points.size()) points.push_back(static_cast<uint32_t>(next));
      next += step.code(coder, points[i] - static_cast<uint32_t>(next));
      fits = next < most_points;
      points[i] = static_cast<uint32_t>(next++);
    }
    count = number.code(coder, static_cast<uint32_t>(copies.size()));
    fits = fits && count <= most_points;
    next = 0;
    for (uint32_t i = 0; i < count && fits; ++i) {
      if (i == copies.size()) copies.push_back({static_cast<uint32_t>(next), 1});
      next += step.code(coder, copies[i].point - static_cast<uint32_t>(next));
      fits = next < most_points;
      copies[i].copy = copy.code(coder, copies[i].copy - 1) + 1;
      copies[i].point = static_cast<uint32_t>(next++);
    }
  }
};

std::vector<std::byte> encode_shared(std::span<const SharedPoint> shared, const std::vector<bool>& border) {
  SharedExceptions exceptions;
  size_t at = 0;
  for (uint32_t i = 0; i < border.size(); ++i) {
    const bool is_shared = at < shared.size() && shared[at].point == i;
    if (is_shared != border[i]) exceptions.points.push_back(i);
    if (is_shared && shared[at].copy > 0) exceptions.copies.push_back(shared[at]);
    at += is_shared;
  }
  if (exceptions.points.empty() && exceptions.copies.empty()) return {};
  RansEncoder encoder;
  bool fits = true;
  exceptions.code(encoder, static_cast<uint32_t>(border.size()), fits);
  return encoder.finish();
}

Result<std::vector<SharedPoint>> decode_shared(Bytes bytes, std::vector<bool> border) {
  SharedExceptions exceptions;
  if (!bytes.empty()) {
    RansDecoder decoder(bytes);
    bool fits = true;
    exceptions.code(decoder, static_cast<uint32_t>(border.size()), fits);
    if (!fits || decoder.exhausted()) return corrupt("shared points that are not there");
  }
  for (const uint32_t point : exceptions.points) border[point] = !border[point];
  std::vector<SharedPoint> shared;
  auto copy = exceptions.copies.begin();
  for (uint32_t i = 0; i < border.size(); ++i) {
    const bool is_copy = copy != exceptions.copies.end() && copy->point == i;
    if (is_copy && !border[i]) return corrupt("a copy of a point that is not shared");
    if (border[i]) shared.push_back({i, is_copy ? copy->copy : 0});
    copy += is_copy;
  }
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
    return std::vector<std::byte>(stream->begin(), stream->end());
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
std::vector<bool> borders_of_coded(const Mesh& part, const PatchSources& sources) {
  std::vector<uint32_t> coded_as(sources.points.size());
  std::iota(coded_as.begin(), coded_as.end(), 0u);
  std::sort(coded_as.begin(), coded_as.end(),
            [&](uint32_t a, uint32_t b) { return sources.points[a] < sources.points[b]; });
  return points_on_borders(part, [&](uint32_t point) { return coded_as[point]; });
}

}  // namespace

Description chart_description(const Description& file, uint32_t level) {
  Description chart;
  chart.effort = file.effort;
  chart.positions = file.positions;
  for (const ArrayDescription& array : file.arrays) {
    if (level > 0 && array.domain != Domain::point) continue;
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
    if (level == 0 || coded.array->domain == Domain::point) chosen.push_back(coded);
  }
  return chosen;
}

Result<ChartSet> chart_set(const Description& file, uint32_t set, Bytes tables) {
  ChartSet result{chart_description(file, set), set == 0, {}};
  if (!tables.empty()) result.tables = MAILLE_TRY(SharedFanTables::read(tables, file.positions.type));
  return result;
}

std::vector<std::byte> chart_bytes(const Mesh& part, const EncodedPatch& patch,
                                   std::optional<std::span<const SharedPoint>> shared) {
  ByteWriter out;
  put_sizes(out, part);
  std::vector<Bytes> streams{patch.topology.bytes};
  for (const CodedStream& stream : patch.arrays) streams.push_back(stream.bytes);
  if (shared) put_section(out, encode_shared(*shared, borders_of_coded(part, patch.sources)));
  out.put_count(patch.topology.key.number | patch.arrays[0].key.number << 4);
  for (size_t i = 0; i + 1 < streams.size(); ++i) out.put_count(streams[i].size());
  for (const Bytes stream : streams) out.put_bytes(stream);
  return out.take();
}

Result<DecodedChart> decode_chart(const ChartSet& set, Bytes bytes, const DecodeOptions& options) {
  ByteReader in(bytes);
  const Description description = MAILLE_TRY(get_sizes(in, set.description));
  const Bytes shared = set.finest ? in.get_bytes(in.get_count()) : Bytes();
  ChartStreams streams;
  MAILLE_CHECK(streams.read(in, description.arrays.size()));
  const SharedFanTables* tables = set.tables.fans ? &set.tables : nullptr;
  DecodedPatch patch = MAILLE_TRY(decode_patch(streams, description, 0, options, tables));
  DecodedChart chart;
  chart.mesh = std::move(patch.mesh);
  if (!patch.known_valid) {
    if (auto valid = validate(chart.mesh); !valid)
      return failure(ErrorCode::corrupt, std::move(valid).error().message);
  }
  if (set.finest) chart.shared = MAILLE_TRY(decode_shared(shared, points_on_borders(chart.mesh, [](uint32_t point) { return point; })));
  return chart;
}

}  // namespace maille
