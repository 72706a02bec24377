// decode_topology() on any bytes: points, corners, blocks, then the stream. What it accepts is a closed
// surface that fits the numbers it was told.

#include "base/bytes.h"
#include "fuzzing.h"
#include "surface/patch_topology.h"

namespace maille::fuzzing {
namespace {

void check_closed(const PatchSurface& surface) {
  const HalfEdges& edges = surface.half_edges;
  const uint32_t count = edges.size();
  require(edges.opposite.size() == count, "every half-edge has an opposite one");
  require(edges.all_triangles() || edges.following.size() == count, "every half-edge has a next one");
  for (uint32_t h = 0; h < count; ++h) {
    const uint32_t over = edges.opposite[h];
    require(over < count && over != h && edges.opposite[over] == h, "half-edges are glued in pairs");
    require(edges.origin[h] < surface.vertices.size() || (edges.origin[h] >= first_dummy),
            "every corner has a vertex");
    require(edges.origin[edges.next(h)] == edges.origin[over], "glued half-edges run along the same edge");
    require(edges.previous(edges.next(h)) == h, "faces are cycles");
  }
  // Corners round vertices: each once.
  std::vector<bool> met(count);
  uint32_t corners = 0;
  for (uint32_t vertex = 0; vertex < surface.vertices.size(); ++vertex) {
    uint32_t h = surface.vertices.corner[vertex];
    do {
      require(edges.origin[h] == vertex && !met[h], "a vertex is one cycle of corners");
      met[h] = true;
      ++corners;
      h = edges.turn(h);
    } while (h != surface.vertices.corner[vertex]);
  }
  for (uint32_t h = 0; h < count; ++h) corners += (edges.origin[h] >= first_dummy);
  require(corners == count, "every corner is met round its vertex");
}

void run(Bytes input) {
  ByteReader in(input);
  const auto points = static_cast<uint32_t>(in.get_count());
  const uint64_t corners = in.get_count() % (1 << 20);
  std::vector<BlockShape> blocks(in.get<uint8_t>() % 8);
  for (BlockShape& block : blocks) {
    block.type = static_cast<CellType>(in.get<uint8_t>());
    block.cells = in.get_count() % (1 << 20);
  }
  const auto topology = decode_topology(in.get_bytes(in.remaining()), blocks, points, corners, true);
  if (!topology) return require_kind(topology.error(), {ErrorCode::corrupt});
  check_closed(topology->surface);
  require(topology->surface.point_count <= points, "no more points than told");
  uint64_t cells = 0;
  for (const BlockShape& block : blocks) cells += block.cells;
  require(topology->elements().cells() == cells, "as many cells as told");
  const AssembledCells assembled = assemble_cells(*topology, blocks, true);
  for (const CellBlock& block : assembled.blocks) {
    for (const uint32_t point : block.connectivity) require(point < points, "corners are points");
  }
}

}  // namespace
}  // namespace maille::fuzzing

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  maille::fuzzing::run(std::as_bytes(std::span(data, size)));
  return 0;
}
