#include "surface/fans/adaptive_start.h"

#include <algorithm>
#include <numeric>
#include <string>

#include "base/bytes.h"
#include "base/result.h"
#include "entropy/rans.h"
#include "numbers/number_maps.h"
#include "surface/fans/adaptive_fan_model.h"
#include "surface/fans/adaptive_position_coder.h"
#include "surface/fans/adaptive_positions.h"
#include "surface/fans/fan_positions.h"
#include "surface/fans/model_states.h"
#include "surface/front/mixed_array.h"

namespace maille {
struct AdaptiveStart {
  AdaptiveFanModel fans;
  PositionsStart positions;
};

bool can_share_start(const ArrayToCode& positions, int effort) {
  return effort > fast_effort && fits_fan_positions(*positions.array, positions.maps);
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
  if (!coded || coded->patch.fans.faces() == 0) return {};
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
  decoder.all_fans = MAILLE_TRY(decode_adaptive_fans(fans, decoder.faces, points, start, end));
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
  MAILLE_CHECK(
      decode_adaptive_positions(decoder.all_fans, sample.positions, sample.points, array, &start.positions));
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

/// As if the whole were a part of itself.
PartNumbers numbers_of_whole(const Mesh& mesh) {
  PartNumbers numbers;
  numbers.points.resize(mesh.point_count());
  std::iota(numbers.points.begin(), numbers.points.end(), 0u);
  for (uint32_t cell = 0; cell < mesh.cell_count(); ++cell) {
    numbers.cells.push_back(cell);
    numbers.first_corner.push_back(3 * cell);
  }
  return numbers;
}

uint64_t size_of(const EncodedPatch& patch) {
  uint64_t size = patch.topology.bytes.size();
  for (const CodedStream& stream : patch.arrays) size += stream.bytes.size();
  return size;
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
                                                   uint64_t faces, int effort) {
  std::vector<std::byte> best;
  if (mesh_.blocks.empty() || probes_.empty()) return best;
  const auto coded = MAILLE_TRY(encode_fan_patch(mesh_, FanModels::adaptive));
  if (!coded) return best;
  double smallest = MAILLE_TRY(size_of_all(maps, nullptr, faces, effort));
  for (const ArrayMaps& way : ways_to_map(maps, positions)) {
    std::vector<std::byte> bytes = MAILLE_TRY(write(*coded, way, positions.array));
    const auto start = MAILLE_TRY(read_start(bytes, mesh_.points.type));
    const double size =
        static_cast<double>(bytes.size()) + MAILLE_TRY(size_of_all(way, start.get(), faces, effort));
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

Result<double> StartSample::size_of_all(const ArrayMaps& maps, const AdaptiveStart* start, uint64_t faces,
                                        int effort) const {
  EncodeOptions options;
  options.effort = effort;
  uint64_t size = 0, probed = 0;
  for (const Mesh& probe : probes_) {
    const ArrayToCode positions{&probe.points, maps};
    const PartNumbers numbers = numbers_of_whole(probe);
    size += size_of(
        start ? MAILLE_TRY(encode_patch_from_start(probe, numbers, 1, {&positions, 1}, options, *start))
              : MAILLE_TRY(encode_patch(probe, &numbers, 1, {&positions, 1}, options)));
    probed += probe.cell_count();
  }
  return static_cast<double>(size) / static_cast<double>(probed) * static_cast<double>(faces);
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

namespace {

/// None when fans are not made for it.
Result<std::optional<SharedFanPatch>> encode_fans_from_start(const Mesh& mesh,
                                                             const std::vector<uint32_t>& points,
                                                             const Array& array, const AdaptiveStart& start) {
  auto coded = MAILLE_TRY(encode_fan_patch(mesh, FanModels::adaptive, &start.fans));
  if (!coded) return std::optional<SharedFanPatch>();
  std::vector<uint32_t> source = coded->sources.points;
  for (uint32_t& point : source) point = points[point];
  std::vector<std::byte> positions =
      encode_adaptive_positions(coded->patch.fans, array, source, start.positions);
  return std::optional(SharedFanPatch{std::move(*coded), std::move(positions)});
}

}  // namespace

Result<EncodedPatch> encode_patch_from_start(const Mesh& mesh, const PartNumbers& numbers, uint32_t patch,
                                             std::span<const ArrayToCode> arrays,
                                             const EncodeOptions& options, const AdaptiveStart& start) {
  auto fans = MAILLE_TRY(encode_fans_from_start(mesh, numbers.points, *arrays[0].array, start));
  const bool with_fans = fans.has_value();
  EncodedPatch coded = MAILLE_TRY(encode_patch(mesh, &numbers, patch, arrays, options, std::move(fans)));
  if (!with_fans || options.effort < least_mixed_effort) return coded;
  EncodedPatch mixed = MAILLE_TRY(encode_patch(mesh, &numbers, patch, arrays, options));
  return size_of(mixed) < size_of(coded) ? std::move(mixed) : std::move(coded);
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
