#include "theory/sqrt3.h"

#include <string>

#include "base/result.h"
#include "theory/block_subdivision.h"
#include "theory/sqrt3_block.h"
#include "theory/subdivision_output.h"

namespace maille {

namespace {

// As trisected() orders them: row by row those that stand on an edge, then those that stand on their tips.
constexpr std::array<Place, 3> parts[] = {
    {{{0, 0}, {1, 0}, {0, 1}}}, {{{1, 0}, {2, 0}, {1, 1}}}, {{{2, 0}, {3, 0}, {2, 1}}},
    {{{0, 1}, {1, 1}, {0, 2}}}, {{{1, 1}, {2, 1}, {1, 2}}}, {{{0, 2}, {1, 2}, {0, 3}}},
    {{{1, 0}, {1, 1}, {0, 1}}}, {{{2, 0}, {2, 1}, {1, 1}}}, {{{1, 1}, {1, 2}, {0, 2}}}};
constexpr BlockScheme scheme = {3, parts, sqrt3_ring_weights, 3, trisected};

// 9^7 small triangles of one (4.8 million) are held in memory at a time; more levels begin with some in
// memory for the whole surface.
constexpr unsigned most_trisections = 7;

Result<> write(const TriangleSurface& surface, SubdivisionOutput& output) {
  MAILLE_CHECK(check_point_count(surface.points.size()));
  MAILLE_CHECK(output.begin(surface.points.size(), surface.triangles()));
  BufferedOutput out(output);
  for (const Position& point : surface.points) MAILLE_CHECK(out.point(point));
  MAILLE_CHECK(out.flush());
  for (uint32_t h = 0; h < surface.half_edges(); h += 3)
    MAILLE_CHECK(out.triangle(surface.corners[h], surface.corners[h + 1], surface.corners[h + 2]));
  return out.flush();
}

/// Before anything is made: half-edges in memory must have numbers.
Result<> check_size(const TriangleSurface& surface, unsigned levels, unsigned in_memory) {
  uint64_t half_edges = surface.half_edges();
  for (unsigned level = 0; level < in_memory && half_edges < TriangleSurface::border; ++level)
    half_edges *= 3;
  if (half_edges < TriangleSurface::border) return {};
  return failure(ErrorCode::usage, std::to_string(levels) + " levels of " +
                                       std::to_string(surface.triangles()) +
                                       " triangles are more than can be done; take fewer");
}

}  // namespace

Result<> subdivide_by_sqrt3(TriangleSurface surface, unsigned levels, SubdivisionOutput& output) {
  // Two levels are a trisection, which blocks can do. An odd one, and those beyond fourteen, come first and
  // in memory.
  unsigned in_memory = levels % 2;
  if (levels > in_memory + 2 * most_trisections) in_memory = levels - 2 * most_trisections;
  MAILLE_CHECK(check_size(surface, levels, in_memory));
  RingWeights weights(sqrt3_ring_weights);
  if (levels % 2 == 1) surface = turned(surface, weights);
  for (unsigned level = levels % 2; level < in_memory; level += 2) {
    // The whole surface as one block without rings.
    const uint32_t all = surface.triangles();
    surface = trisected({std::move(surface), all}, weights, 0).surface;
  }
  if (levels == 1) return write(surface, output);
  return subdivide_in_blocks(surface, (levels - in_memory) / 2, scheme, output);
}

}  // namespace maille
