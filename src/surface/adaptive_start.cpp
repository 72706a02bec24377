#include "surface/adaptive_start.h"

#include <algorithm>
#include <numeric>
#include <string>

#include "base/bytes.h"
#include "base/result.h"
#include "entropy/rans.h"
#include "surface/adaptive_fan_model.h"
#include "surface/adaptive_position_coder.h"
#include "surface/adaptive_positions.h"
#include "surface/fan_positions.h"
#include "surface/mixed_array.h"
#include "surface/model_states.h"
#include "surface/number_maps.h"

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
  return charts < 8 ? 0 : std::min<size_t>(charts, 32);
}

namespace {

// About a byte each, which a reader waits for before it has the first chart.
constexpr size_t most_numbers_in_start = 1 << 17;

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

/// A patch of the sample, coded.
struct CodedSample {
  Bytes fans, positions;
  uint32_t points;
  uint64_t corners;
  Scalar type;
};

/// What models know behind it.
Result<AdaptiveStart> learn(const CodedSample& sample) {
  AdaptiveStart start;
  const FanPatchDecoder decoder =
      MAILLE_TRY(begin_with_models(sample.fans, sample.points, sample.corners, nullptr, &start.fans));
  Array array = make_array("position", Domain::point, sample.type, 3);
  MAILLE_CHECK(decode_adaptive_positions(decoder.adaptive_fans, sample.positions, sample.points, array,
                                         &start.positions));
  return start;
}

/// As they are, and with tables of all numbers, where these are known and come again: charts alone could
/// not tell which ones there are.
std::vector<ArrayMaps> ways_to_map(const ArrayMaps& maps, const StartSample::Positions& positions) {
  std::vector<ArrayMaps> ways{maps};
  if (!maps.lossless || !positions.complete) return ways;
  std::vector<uint32_t> source(positions.array.count());
  std::iota(source.begin(), source.end(), 0u);
  ArrayMaps ranks = maps;
  ranks.maps = with_tables(positions.array, maps.maps, source);
  size_t numbers = 0;
  for (const NumberMap& map : ranks.maps) numbers += map.table.size();
  if (numbers > 0 && numbers <= most_numbers_in_start) ways.push_back(std::move(ranks));
  return ways;
}

std::vector<std::byte> write_start(AdaptiveStart& start) {
  ByteWriter out;
  out.put_bytes(write_positions_head(start.positions));
  RansEncoder encoder;
  code_positions_start(encoder, start.positions);
  ModelStateCoder states(encoder);
  start.fans.visit_models(states);
  out.put_bytes(encoder.finish());
  return out.take();
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

Result<std::vector<std::byte>> StartSample::finish(const ArrayMaps& maps, const Positions& positions,
                                                   uint64_t faces) {
  std::vector<std::byte> best;
  if (mesh_.blocks.empty() || probes_.empty()) return best;
  const auto coded = MAILLE_TRY(encode_fan_patch(mesh_, FanModels::adaptive));
  if (!coded) return best;
  double smallest = MAILLE_TRY(size_alone(maps, faces));
  for (const ArrayMaps& way : ways_to_map(maps, positions)) {
    std::vector<std::byte> bytes = MAILLE_TRY(write(*coded, way, positions.array));
    const double size = static_cast<double>(bytes.size()) + MAILLE_TRY(size_from_start(bytes, faces));
    if (size >= smallest) continue;
    smallest = size;
    best = std::move(bytes);
  }
  mesh_ = {};
  probes_.clear();
  return best;
}

/// What the sample teaches with these maps.
Result<std::vector<std::byte>> StartSample::write(const EncodedFanPatch& coded, const ArrayMaps& maps,
                                                  const Array& all) const {
  const std::vector<std::byte> positions =
      encode_position_sample(coded.patch.fans, mesh_.points, maps, coded.sources.points, all);
  const auto count = static_cast<uint32_t>(mesh_.point_count());
  const uint64_t corners = mesh_.blocks[0].connectivity.size();
  AdaptiveStart learnt = MAILLE_TRY(learn({coded.bytes, positions, count, corners, mesh_.points.type}));
  return write_start(learnt);
}

double StartSample::size_of_all(uint64_t size_of_probes, uint64_t faces) const {
  uint64_t probed = 0;
  for (const Mesh& probe : probes_) probed += probe.cell_count();
  return static_cast<double>(size_of_probes) / static_cast<double>(probed) * static_cast<double>(faces);
}

Result<double> StartSample::size_alone(const ArrayMaps& maps, uint64_t faces) const {
  uint64_t size = 0;
  for (const Mesh& probe : probes_) {
    const auto alone = MAILLE_TRY(encode_fan_patch(probe, FanModels::adaptive));
    if (!alone) continue;
    size += alone->bytes.size() +
            encode_adaptive_positions(alone->patch.fans, probe.points, maps, alone->sources.points).size();
  }
  return size_of_all(size, faces);
}

Result<double> StartSample::size_from_start(const std::vector<std::byte>& bytes, uint64_t faces) const {
  const auto start = MAILLE_TRY(read_start(bytes, mesh_.points.type));
  uint64_t size = 0;
  for (const Mesh& probe : probes_) {
    std::vector<uint32_t> points(probe.point_count());
    std::iota(points.begin(), points.end(), 0u);
    const auto started = MAILLE_TRY(encode_from_start(probe, points, probe.points, *start));
    if (started) size += started->coded.bytes.size() + started->positions.size();
  }
  return size_of_all(size, faces);
}

Result<std::shared_ptr<const AdaptiveStart>> read_start(Bytes bytes, Scalar type) {
  ByteReader in(bytes);
  auto start = std::make_shared<AdaptiveStart>();
  start->positions = MAILLE_TRY(read_positions_head(in, type));
  RansDecoder decoder(in.get_bytes(in.remaining()));
  MAILLE_CHECK(code_positions_start(decoder, start->positions));
  ModelStateCoder states(decoder);
  start->fans.visit_models(states);
  if (decoder.exhausted()) return failure(ErrorCode::corrupt, "the start of the charts is not whole");
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
