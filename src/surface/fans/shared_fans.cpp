#include "surface/fans/shared_fans.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "base/bytes.h"
#include "base/result.h"
#include "code/efforts.h"
#include "numbers/number_maps.h"
#include "numbers/refined_numbers.h"

namespace maille {
namespace {

/// Adds the vertices of a patch, which refer to themselves only.
void append_vertices(FanSurface& sample, const FanSurface& fans) {
  const uint32_t first = sample.vertices;
  for (uint32_t v = 0; v < fans.vertices; ++v) {
    VertexReferences references = fans.references[v];
    for (uint32_t& at : references.at) at += first;
    sample.references.push_back(references);
    sample.kinds.push_back(fans.kinds[v]);
    sample.valences.push_back(fans.valences[v]);
  }
  sample.vertices += fans.vertices;
}

/// Numbers that a lattice cannot hold.
std::vector<uint64_t> exceptions_of(const Array& array, const ArrayMaps& maps) {
  std::vector<uint64_t> exceptions;
  if (maps.lossless || !is_float(array.type)) return exceptions;
  const size_t size = size_of(array.type);
  for (size_t i = 0; i < array.bytes.size() / size; ++i) {
    if (!std::isfinite(number_as_double(array.type, array.bytes.data() + i * size))) exceptions.push_back(i);
  }
  return exceptions;
}

RefinedMaps refine_all(const Array& array, std::span<const NumberMap> maps) {
  std::vector<uint32_t> source(array.count());
  std::iota(source.begin(), source.end(), 0u);
  return refine_maps(array, maps, source);
}

// About a byte each, which a reader waits for before it has the first chart; so tables stay below 64 KiB.
// Chosen, not swept.
constexpr size_t most_shared_numbers = 1 << 16;

/// Maps whose tables would be too long stay as they are.
void forget_long_tables(RefinedMaps& refined, std::span<const NumberMap> maps) {
  size_t numbers = 0;
  for (const NumberMap& map : refined.coarse) numbers += map.table.size();
  for (size_t k = 0; k < maps.size() && numbers > most_shared_numbers; ++k) {
    if (!refined.refined[k]) refined.coarse[k] = maps[k];
  }
}

}  // namespace

bool can_share_tables(const ArrayToCode& positions) {
  return fits_positions(*positions.array, positions.maps);
}

Result<> SharedFanEncoder::add(const Mesh& mesh, const std::vector<uint32_t>& points, const Array& array) {
  const auto coded = MAILLE_TRY(encode_fan_patch(mesh, FanModels::shared));
  if (!coded) return {};
  const bool polygons = !coded->patch.fans.offsets.empty();
  if (sample_.vertices == 0) {
    positions_ = make_array(array.name, array.domain, array.type, array.components);
    counts_ = FanCounts(polygons);
    // Of no faces, but those would be polygons.
    if (polygons) sample_.offsets.push_back(0);
  }
  // The first patch said which kind the tables are for; the other kind is left out.
  if (polygons == sample_.offsets.empty()) return {};
  const size_t size = array.tuple_size();
  const FanSurface& fans = coded->patch.fans;
  for (uint32_t v = 0; v < fans.vertices; ++v) {
    const std::byte* const tuple = array.bytes.data() + points[coded->sources.points[v]] * size;
    positions_.bytes.insert(positions_.bytes.end(), tuple, tuple + size);
  }
  append_vertices(sample_, fans);
  counts_.add(coded->operations);
  return {};
}

uint64_t range_of_codes(const ArrayToCode& positions) {
  const Array& array = *positions.array;
  const size_t size = size_of(array.type);
  uint64_t widest = 0;
  for (unsigned k = 0; k < 3; ++k) {
    int64_t low = INT64_MAX, high = INT64_MIN;
    for (size_t i = k; i < 3 * array.count(); i += 3) {
      if (std::binary_search(positions.maps.exceptions.begin(), positions.maps.exceptions.end(), i)) continue;
      const int64_t code = positions.maps.maps[k].code_of(array.type, array.bytes.data() + i * size);
      low = std::min(low, code);
      high = std::max(high, code);
    }
    if (low <= high) widest = std::max(widest, static_cast<uint64_t>(high) - static_cast<uint64_t>(low));
  }
  return widest;
}

void SharedFanEncoder::consider_coarse(const Array& all, ArrayMaps maps, const Effort& effort) {
  RefinedMaps refined = refine_all(all, maps.maps);
  forget_long_tables(refined, maps.maps);
  if (!refined.any() && !has_tables(refined.coarse)) return;
  maps.maps = refined.coarse;
  const uint64_t range = has_tables(maps.maps) ? UINT64_MAX : range_of_codes({&all, maps});
  SharedPositions coarse(sample_, positions_, maps, effort, range, std::move(refined));
  if (coarse.size_of(all.count()) < coder_->size_of(all.count())) coder_ = std::move(coarse);
}

std::vector<std::byte> SharedFanEncoder::finish(const ArrayMaps& maps, int effort, uint64_t most_range,
                                                const Array* all) {
  if (sample_.vertices == 0) return {};
  // Coarse maps of a sample may not be those of the whole.
  if (all == nullptr && maps.lossless && refine_all(positions_, maps.maps).any()) return {};
  ArrayMaps of_sample = maps;
  of_sample.exceptions = exceptions_of(positions_, maps);
  const Effort& row = effort_of(effort);
  coder_.emplace(sample_, positions_, of_sample, row, most_range);
  if (all != nullptr && maps.lossless) consider_coarse(*all, of_sample, row);
  RansEncoder side;
  counts_.spread();
  tables_ = counts_.make_tables(side);
  sample_ = {};
  positions_.bytes = {};
  ByteWriter out;
  put_section(out, side.finish());
  out.put_bytes(coder_->tables());
  return out.take();
}

Result<std::optional<SharedFanPatch>> SharedFanEncoder::encode(const Mesh& mesh,
                                                               const std::vector<uint32_t>& points,
                                                               const ArrayToCode& positions) const {
  using Found = std::optional<SharedFanPatch>;
  if (!coder_) return Found();
  auto coded = MAILLE_TRY(encode_fan_patch(mesh, FanModels::shared));
  if (!coded || coded->patch.fans.offsets.empty() == tables_.polygons) return Found();
  // A rare symbol that the sample did not have: this patch has tables of its own.
  if (!can_write_fans(coded->operations, tables_)) return Found();
  std::vector<uint32_t> source = coded->sources.points;
  for (uint32_t& point : source) point = points[point];
  auto bytes = coder_->encode(coded->patch.fans, *positions.array, positions.maps.exceptions, source);
  if (!bytes) return Found();
  coded->bytes = write_shared_fan_patch(*coded, tables_);
  std::vector<FanOperation>().swap(coded->operations);
  return Found(SharedFanPatch{std::move(*coded), *std::move(bytes)});
}

uint64_t size_of_patch(const EncodedPatch& patch) {
  uint64_t size = patch.topology.bytes.size();
  for (const CodedStream& stream : patch.arrays) size += stream.bytes.size();
  return size;
}

Result<EncodedPatch> encode_chart(const Mesh& mesh, const PartNumbers& numbers,
                                  std::span<const ArrayToCode> arrays, const EncodeOptions& options,
                                  const SharedFanEncoder& shared) {
  // Not patch 0: arrays of the mesh as a whole are not in charts.
  constexpr uint32_t patch = 1;
  auto fans = MAILLE_TRY(shared.encode(mesh, numbers.points, arrays[0]));
  const bool with_fans = fans.has_value();
  EncodedPatch coded = MAILLE_TRY(encode_patch(mesh, &numbers, patch, arrays, options, std::move(fans)));
  // Mixing begins anew with each chart, so at -7 to -9 a chart may be smaller with shared tables (61ff86e).
  if (!with_fans || !effort_of(options.effort).mixed_surface) return coded;
  EncodedPatch mixed = MAILLE_TRY(encode_patch(mesh, &numbers, patch, arrays, options));
  return size_of_patch(mixed) < size_of_patch(coded) ? std::move(mixed) : std::move(coded);
}

Result<SharedFanTables> SharedFanTables::read(Bytes bytes, Scalar type) {
  ByteReader in(bytes);
  const Bytes of_fans = in.get_bytes(in.get_count());
  if (!in.ok()) return failure(ErrorCode::corrupt, "the tables of the charts end early");
  SharedFanTables tables;
  tables.positions = MAILLE_TRY(read_position_tables(in.get_bytes(in.remaining()), type));
  RansDecoder side(of_fans);
  const FanTables fans = read_fan_tables(side, are_of_polygons(*tables.positions));
  if (side.exhausted()) return failure(ErrorCode::corrupt, "the tables of the charts end early");
  tables.fans = std::make_shared<const FanSlots>(fans);
  return tables;
}

}  // namespace maille
