#pragma once

#include "theory/subdivision_point.h"
#include "theory/surface_block.h"

namespace maille {

/// One level of sqrt(3): a point in each triangle, and every inner edge turned. A triangle at the border
/// keeps its border edge. Three triangles for each, all over the surface.
TriangleSurface turned(const TriangleSurface& surface, RingWeights& weights);

/// Two levels of sqrt(3), of which the second cuts border edges in three: nine triangles for each inner one,
/// in a lattice of three steps to a side, and `rings` rings of the new size around them, 0 or 3. What a new
/// point depends on lies within two rings of its triangle; so three are enough for those of the first ring,
/// and three rings of small triangles lie within it.
SurfaceBlock trisected(const SurfaceBlock& block, RingWeights& weights, unsigned rings);

}  // namespace maille
