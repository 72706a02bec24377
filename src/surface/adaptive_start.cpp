#include "surface/adaptive_start.h"

#include <numeric>
#include <string>

#include "base/bytes.h"
#include "base/result.h"
#include "surface/adaptive_fan_model.h"
#include "surface/adaptive_position_coder.h"
#include "surface/adaptive_positions.h"
#include "surface/fan_positions.h"
#include "surface/mixed_array.h"

namespace maille {
struct AdaptiveStart {
  AdaptiveFanModel fans;
  PositionsStart positions;
};

bool can_share_start(const ArrayToCode& positions, int effort) {
  return effort > fast_effort && effort < least_mixed_effort &&
         fits_fan_positions(*positions.array, positions.maps);
}

size_t charts_in_start(size_t charts) {
  // The first saves 5 % of what all take, the second 1 % more.
  return charts < 32 ? 0 : charts < 128 ? 1 : 2;
}

namespace {

/// Adds the triangles of a patch, and their points: what else there is says nothing of them.
Result<> append_patch(Mesh& sample, const Mesh& mesh, const std::vector<uint32_t>& points,
                      const Array& array) {
  const auto coded = MAILLE_TRY(encode_fan_patch(mesh, FanModels::adaptive));
  if (!coded || coded->patch.fans.triangles() == 0) return {};
  if (sample.blocks.empty()) {
    sample.blocks.emplace_back().type = CellType::triangle;
    sample.points = make_array(array.name, array.domain, array.type, array.components);
  }
  const auto first = static_cast<uint32_t>(sample.point_count());
  const FanSurface& fans = coded->patch.fans;
  for (const uint32_t v : fans.corners) sample.blocks[0].connectivity.push_back(first + v);
  const size_t size = array.tuple_size();
  for (uint32_t v = 0; v < fans.vertices; ++v) {
    const std::byte* const tuple = array.bytes.data() + points[coded->sources.points[v]] * size;
    sample.points.bytes.insert(sample.points.bytes.end(), tuple, tuple + size);
  }
  return {};
}

}  // namespace

Result<> StartSample::add(const Mesh& mesh, const std::vector<uint32_t>& points, const Array& array) {
  return append_patch(mesh_, mesh, points, array);
}

Result<> StartSample::add_probe(const Mesh& mesh, const std::vector<uint32_t>& points, const Array& array) {
  MAILLE_CHECK(append_patch(probes_.emplace_back(), mesh, points, array));
  if (probes_.back().blocks.empty()) probes_.pop_back();
  return {};
}

Result<std::vector<std::byte>> StartSample::finish(const ArrayMaps& maps, const Array& all, uint64_t faces) {
  if (mesh_.blocks.empty()) return std::vector<std::byte>();
  const auto coded = MAILLE_TRY(encode_fan_patch(mesh_, FanModels::adaptive));
  if (!coded) return std::vector<std::byte>();
  ByteWriter out;
  out.put_count(mesh_.point_count());
  out.put_count(mesh_.blocks[0].connectivity.size());
  out.put_count(coded->bytes.size());
  out.put_bytes(coded->bytes);
  out.put_bytes(encode_position_sample(coded->patch.fans, mesh_.points, maps, coded->sources.points, all));
  std::vector<std::byte> sample = out.take();
  if (!MAILLE_TRY(pays(sample, maps, faces))) sample.clear();
  mesh_ = {};
  probes_.clear();
  return sample;
}

Result<bool> StartSample::pays(const std::vector<std::byte>& sample, const ArrayMaps& maps,
                               uint64_t faces) const {
  const auto start = MAILLE_TRY(read_start(sample, mesh_.points.type));
  uint64_t with = 0, without = 0, probed = 0;
  for (const Mesh& probe : probes_) {
    std::vector<uint32_t> points(probe.point_count());
    std::iota(points.begin(), points.end(), 0u);
    const auto alone = MAILLE_TRY(encode_fan_patch(probe, FanModels::adaptive));
    const auto started = MAILLE_TRY(encode_from_start(probe, points, probe.points, *start));
    if (!alone || !started) continue;
    const FanSurface& fans = alone->patch.fans;
    without += alone->bytes.size() +
               encode_adaptive_positions(fans, probe.points, maps, alone->sources.points).size();
    with += started->coded.bytes.size() + started->positions.size();
    probed += probe.cell_count();
  }
  const auto saved = static_cast<double>(without) - static_cast<double>(with);
  return probed > 0 && saved / static_cast<double>(probed) * static_cast<double>(faces) >
                           static_cast<double>(sample.size());
}

namespace {

Result<FanPatchDecoder> begin_with_models(Bytes bytes, uint32_t points, uint64_t corners,
                                          const AdaptiveFanModel* start, AdaptiveFanModel* end) {
  ByteReader in(bytes);
  const uint64_t triangles = in.get_count();
  const Bytes fans = in.get_bytes(in.get_count());
  FanPatchDecoder decoder;
  MAILLE_CHECK(decoder.read_sections(in, triangles, corners));
  decoder.adaptive_fans = MAILLE_TRY(decode_adaptive_fans(fans, decoder.triangles, points, start, end));
  return decoder;
}

}  // namespace

Result<std::shared_ptr<const AdaptiveStart>> read_start(Bytes bytes, Scalar type) {
  ByteReader in(bytes);
  const uint64_t points = in.get_count(), corners = in.get_count();
  const Bytes topology = in.get_bytes(in.get_count());
  const Bytes positions = in.get_bytes(in.remaining());
  if (!in.ok() || points > most_fan_points)
    return failure(ErrorCode::corrupt, "the start of the charts is not whole");
  const auto count = static_cast<uint32_t>(points);
  auto start = std::make_shared<AdaptiveStart>();
  const FanPatchDecoder decoder =
      MAILLE_TRY(begin_with_models(topology, count, corners, nullptr, &start->fans));
  Array array = make_array("position", Domain::point, type, 3);
  MAILLE_CHECK(decode_adaptive_positions(decoder.adaptive_fans, positions, count, array, &start->positions));
  start->fans.forget_recent();
  return std::shared_ptr<const AdaptiveStart>(std::move(start));
}

Result<std::optional<SharedFanPatch>> encode_from_start(const Mesh& mesh, const std::vector<uint32_t>& points,
                                                        const Array& array, const AdaptiveStart& start) {
  auto coded = MAILLE_TRY(encode_fan_patch(mesh, FanModels::adaptive, &start.fans));
  if (!coded) return std::optional<SharedFanPatch>();
  std::vector<uint32_t> source = coded->sources.points;
  for (uint32_t& point : source) point = points[point];
  std::vector<std::byte> positions =
      encode_adaptive_positions(coded->patch.fans, array, source, start.positions);
  return std::optional(SharedFanPatch{std::move(*coded), std::move(positions)});
}

Result<FanPatchDecoder> begin_fan_patch(Bytes bytes, uint32_t points, uint64_t corners,
                                        const AdaptiveStart& start) {
  return begin_with_models(bytes, points, corners, &start.fans, nullptr);
}

Result<> decode_adaptive_positions(const FanSurface& fans, Bytes bytes, uint32_t points, Array& array,
                                   const AdaptiveStart& start) {
  return decode_adaptive_positions(fans, bytes, points, array, start.positions);
}

}  // namespace maille
