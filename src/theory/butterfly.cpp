#include "theory/butterfly.h"

#include <string>

#include "base/result.h"
#include "theory/block_subdivision.h"
#include "theory/butterfly_block.h"

namespace maille {

namespace {

// As refined() orders them: at the three corners, in the middle.
constexpr std::array<Place, 3> parts[] = {{{{0, 0}, {1, 0}, {0, 1}}},
                                          {{{2, 0}, {1, 1}, {1, 0}}},
                                          {{{0, 2}, {0, 1}, {1, 1}}},
                                          {{{1, 0}, {1, 1}, {0, 1}}}};
constexpr BlockScheme scheme = {2, parts, butterfly_ring_weights, 2, refined};

// 4^12 small triangles take a gigabyte; whoever wants more can subdivide the result again.
constexpr unsigned most_levels = 12;

}  // namespace

Result<> subdivide_by_butterfly(const TriangleSurface& surface, unsigned levels, SubdivisionOutput& output) {
  if (levels > most_levels) {
    return failure(ErrorCode::usage, std::to_string(levels) + " levels are more than " +
                                         std::to_string(most_levels) +
                                         ", the most for the butterfly; take fewer");
  }
  return subdivide_in_blocks(surface, levels, scheme, output);
}

}  // namespace maille
