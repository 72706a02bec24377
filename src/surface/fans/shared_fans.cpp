#include "surface/fans/shared_fans.h"

#include <string>

#include "base/bytes.h"
#include "base/result.h"
#include "numbers/number_maps.h"
#include "surface/fans/fan_tables.h"

namespace maille {
namespace {

// Readers shall find the first charts in the first 64 KiB of a file.
constexpr size_t most_map_bytes = 16 * 1024;

size_t bytes_of(const std::vector<NumberMap>& maps) {
  ByteWriter out;
  for (const NumberMap& map : maps) write_map(out, map);
  return out.size();
}

}  // namespace

bool can_share_tables(const ArrayToCode& positions, int effort) {
  return effort <= fast_effort && fits_fan_positions(*positions.array, positions.maps);
}

SharedFanEncoder::SharedFanEncoder(size_t patches, const ArrayToCode& positions, const EncodeOptions& options)
    : positions_(positions), options_(options), patches_(patches), points_(patches) {}

Result<> SharedFanEncoder::find(size_t patch, const Mesh& mesh,
                                const std::vector<uint32_t>& points_in_whole) {
  auto coded = MAILLE_TRY(encode_fan_patch(mesh, FanModels::shared));
  if (!coded) return {};
  points_[patch] = coded->sources.points;
  for (uint32_t& point : points_[patch]) point = points_in_whole[point];
  patches_[patch] = SharedFanPatch{std::move(*coded), {}};
  return {};
}

std::vector<std::byte> SharedFanEncoder::finish(Executor& executor) {
  std::vector<PatchOfPositions> to_code;
  std::vector<SharedFanPatch*> patches;
  FanCounts counts;
  std::vector<uint32_t> all_points;
  for (size_t i = 0; i < patches_.size(); ++i) {
    if (!patches_[i]) continue;
    patches.push_back(&*patches_[i]);
    to_code.push_back({&patches_[i]->coded.patch.fans, points_[i]});
    counts.add(patches_[i]->coded.operations);
  }
  if (patches.empty()) return {};

  ArrayMaps maps = positions_.maps;
  if (maps.lossless) {
    for (const auto& points : points_) all_points.insert(all_points.end(), points.begin(), points.end());
    auto with = with_tables(*positions_.array, maps.maps, all_points);
    if (bytes_of(with) <= most_map_bytes) maps.maps = std::move(with);
  }
  SharedPositionBytes positions =
      encode_shared_positions(to_code, *positions_.array, maps, options_.effort > 1, executor);
  RansEncoder side;
  const FanTables tables = counts.make_tables(side);
  executor.parallel_for(patches.size(), [&](size_t i) {
    SharedFanPatch& patch = *patches[i];
    patch.positions = std::move(positions.patches[i]);
    patch.coded.bytes = write_shared_fan_patch(patch.coded, tables);
    std::vector<FanOperation>().swap(patch.coded.operations);
  });
  ByteWriter out;
  put_section(out, side.finish());
  out.put_bytes(positions.tables);
  return out.take();
}

Result<> SampledFanEncoder::add(const Mesh& mesh, const std::vector<uint32_t>& points, const Array& array) {
  auto coded = MAILLE_TRY(encode_fan_patch(mesh, FanModels::shared));
  if (!coded) return {};
  if (sample_.empty()) positions_ = make_array(array.name, array.domain, array.type, array.components);
  const size_t size = array.tuple_size();
  std::vector<uint32_t>& sources = sources_.emplace_back();
  for (const uint32_t point : coded->sources.points) {
    sources.push_back(static_cast<uint32_t>(positions_.count()));
    const std::byte* const tuple = array.bytes.data() + points[point] * size;
    positions_.bytes.insert(positions_.bytes.end(), tuple, tuple + size);
  }
  sample_.push_back(std::move(*coded));
  return {};
}

std::vector<std::byte> SampledFanEncoder::finish(const ArrayMaps& maps, int effort, uint64_t most_range,
                                                 Executor& executor) {
  if (sample_.empty()) return {};
  FanCounts counts;
  std::vector<PatchOfPositions> to_code;
  for (size_t i = 0; i < sample_.size(); ++i) {
    counts.add(sample_[i].operations);
    to_code.push_back({&sample_[i].patch.fans, sources_[i]});
  }
  coder_ = sample_positions(to_code, positions_, maps, effort > 1, most_range, executor);
  RansEncoder side;
  counts.spread();
  tables_ = counts.make_tables(side);
  sample_.clear();
  sources_.clear();
  positions_.bytes = {};
  ByteWriter out;
  put_section(out, side.finish());
  out.put_bytes(coder_->tables());
  return out.take();
}

Result<std::optional<SharedFanPatch>> SampledFanEncoder::encode(const Mesh& mesh,
                                                                const std::vector<uint32_t>& points,
                                                                const Array& array) const {
  using Found = std::optional<SharedFanPatch>;
  if (!coder_) return Found();
  auto coded = MAILLE_TRY(encode_fan_patch(mesh, FanModels::shared));
  if (!coded || !can_write_fans(coded->operations, tables_)) return Found();
  std::vector<uint32_t> source = coded->sources.points;
  for (uint32_t& point : source) point = points[point];
  auto positions = coder_->encode({&coded->patch.fans, source}, array);
  if (!positions) return Found();
  coded->bytes = write_shared_fan_patch(*coded, tables_);
  std::vector<FanOperation>().swap(coded->operations);
  return Found(SharedFanPatch{std::move(*coded), *std::move(positions)});
}

Result<SharedFanTables> SharedFanTables::read(Bytes bytes, Scalar type) {
  ByteReader in(bytes);
  const Bytes of_fans = in.get_bytes(in.get_count());
  if (!in.ok()) return failure(ErrorCode::corrupt, "the tables of the charts end early");
  RansDecoder side(of_fans);
  const FanTables fans = read_fan_tables(side);
  if (side.exhausted()) return failure(ErrorCode::corrupt, "the tables of the charts end early");
  SharedFanTables tables;
  tables.fans = std::make_shared<const FanSlots>(fans);
  tables.positions = MAILLE_TRY(read_position_tables(in.get_bytes(in.remaining()), type));
  return tables;
}

}  // namespace maille
