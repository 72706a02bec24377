// TOPO and POSI of fans on any bytes: points and coding of positions, corners, blocks, size of the topology,
// topology, positions. What is accepted are triangles and cells over points that are there.

#include "base/bytes.h"
#include "fuzzing.h"
#include "surface/fans/fan_patch.h"
#include "surface/fans/positions.h"

namespace maille::fuzzing {
namespace {

void run(Bytes input) {
  ByteReader in(input);
  const auto points = static_cast<uint32_t>(in.get_count() % (1 << 20));
  const uint64_t corners = in.get_count() % (1 << 20);
  std::vector<BlockShape> blocks(in.get<uint8_t>() % 8);
  for (BlockShape& block : blocks) {
    block.type = static_cast<CellType>(in.get<uint8_t>());
    block.cells = in.get_count() % (1 << 20);
  }
  const Bytes topology = in.get_bytes(std::min<uint64_t>(in.get_count(), in.remaining()));
  const Bytes positions = in.get_bytes(in.remaining());
  auto decoder = FanPatchDecoder::begin(topology, points, corners);
  if (!decoder) return require_kind(decoder.error(), {ErrorCode::corrupt});
  if (!positions.empty()) {
    Array array = make_array("position", Domain::point, Scalar::f32, 3);
    const auto decoded = decode_positions(*decoder->fans, positions, points, array);
    if (!decoded) return require_kind(decoded.error(), {ErrorCode::corrupt});
    require(array.count() == points, "as many positions as told");
  }
  auto patch = decoder->finish(blocks, points, corners);
  if (!patch) return require_kind(patch.error(), {ErrorCode::corrupt});
  require(patch->fans.vertices <= points, "no more points than told");
  const auto built = build_surface(patch->fans, patch->topology);
  if (!built) require_kind(built.error(), {ErrorCode::corrupt});
  uint64_t cells = 0;
  for (const BlockShape& block : blocks) cells += block.cells;
  uint64_t assembled = 0;
  const AssembledCells made = assemble_fans(std::move(patch->fans), patch->topology, blocks, false);
  for (const CellBlock& block : made.blocks) {
    for (const uint32_t point : block.connectivity) require(point < points, "corners are points");
    assembled += block.size();
  }
  require(assembled == cells, "as many cells as told");
}

}  // namespace
}  // namespace maille::fuzzing

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  maille::fuzzing::run(std::as_bytes(std::span(data, size)));
  return 0;
}
