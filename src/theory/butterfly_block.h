#pragma once

#include "theory/subdivision_point.h"
#include "theory/surface_block.h"

namespace maille {

/// The next level of the butterfly: four triangles for each inner one, at its first, second and third corner
/// and in its middle, and `rings` rings of the new size around them, 0 or 2. What a new point depends on are
/// the rings of the ends of its edge; for edges of inner triangles and the first ring these are all here, and
/// two rings of small triangles lie within one of large ones.
SurfaceBlock refined(const SurfaceBlock& block, RingWeights& weights, unsigned rings);

}  // namespace maille
