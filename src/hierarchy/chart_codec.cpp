#include "hierarchy/chart_codec.h"

#include <algorithm>
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

/// Sizes that a description leaves open.
void put_sizes(ByteWriter& out, const Mesh& part) {
  out.put_count(part.point_count());
  out.put_count(part.corner_count());
  for (const CellBlock& block : part.blocks) out.put_count(block.size());
}

Result<Description> get_sizes(ByteReader& in, Description description) {
  const uint64_t points = in.get_count();
  description.corners = in.get_count();
  for (CodedBlock& block : description.blocks) block.shape.cells = in.get_count();
  if (!in.ok() || points > max_points || description.cells() >= max_points)
    return corrupt("sizes that are none");
  description.points = static_cast<uint32_t>(points);
  return description;
}

/// The shared points as steps from one to the next, and the copies of those that are not the first.
std::vector<std::byte> encode_shared(std::span<const SharedPoint> shared) {
  if (shared.empty()) return {};
  RansEncoder encoder;
  CountModel step, copy;
  uint32_t next = 0;
  for (const SharedPoint& point : shared) {
    step.code(encoder, point.point - next);
    copy.code(encoder, point.copy);
    next = point.point + 1;
  }
  return encoder.finish();
}

Result<std::vector<SharedPoint>> decode_shared(Bytes bytes, uint32_t count, uint32_t points) {
  std::vector<SharedPoint> shared;
  RansDecoder decoder(bytes);
  CountModel step, copy;
  uint64_t next = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const uint64_t point = next + step.code(decoder, 0);
    const uint32_t number = copy.code(decoder, 0);
    if (decoder.exhausted() || point >= points) return corrupt("shared points that are not there");
    shared.push_back({static_cast<uint32_t>(point), number});
    next = point + 1;
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
    std::vector<uint64_t> sizes(arrays + 2);
    for (uint64_t& size : sizes) size = in.get_count();
    for (const uint64_t size : sizes) streams_.push_back(in.get_bytes(size));
    if (!in.ok() || in.remaining() > 0) return corrupt("streams that are not whole");
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

std::vector<std::byte> chart_bytes(const Mesh& part, const EncodedPatch& patch,
                                   std::span<const SharedPoint> shared) {
  ByteWriter out;
  put_sizes(out, part);
  const std::vector<std::byte> shared_bytes = encode_shared(shared);
  out.put_count(shared.size());
  out.put_count(shared_bytes.size());
  out.put_bytes(shared_bytes);
  out.put_count(patch.topology.key.number | patch.arrays[0].key.number << 4);
  out.put_count(patch.topology.bytes.size());
  for (const CodedStream& stream : patch.arrays) out.put_count(stream.bytes.size());
  out.put_bytes(patch.topology.bytes);
  for (const CodedStream& stream : patch.arrays) out.put_bytes(stream.bytes);
  return out.take();
}

Result<double> claimed_bytes(const Description& described, Bytes bytes) {
  ByteReader in(bytes);
  return memory_of(MAILLE_TRY(get_sizes(in, described)));
}

Result<DecodedChart> decode_chart(const Description& described, Bytes bytes, const DecodeOptions& options) {
  ByteReader in(bytes);
  const Description description = MAILLE_TRY(get_sizes(in, described));
  const uint64_t shared_count = in.get_count();
  const Bytes shared = in.get_bytes(in.get_count());
  if (!in.ok() || shared_count > description.points) return corrupt("more shared points than points");
  ChartStreams streams;
  MAILLE_CHECK(streams.read(in, description.arrays.size()));
  DecodedChart chart;
  chart.shared = MAILLE_TRY(decode_shared(shared, static_cast<uint32_t>(shared_count), description.points));
  // Not patch 0: arrays of the mesh as a whole are not in charts.
  DecodedPatch patch = MAILLE_TRY(decode_patch(streams, description, 1, options));
  chart.mesh = std::move(patch.mesh);
  if (patch.known_valid) return chart;
  if (auto valid = validate(chart.mesh); !valid)
    return failure(ErrorCode::corrupt, std::move(valid).error().message);
  return chart;
}

}  // namespace maille
