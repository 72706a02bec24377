#pragma once

#include <maille/subdivide.h>

#include "theory/triangle_surface.h"

namespace maille {

/// The interpolating sqrt(3) scheme (Labsik and Greiner 2000), at least one level: each triples the
/// triangles. Two levels at a time are made in blocks; an odd one comes first and is made in memory: three
/// times the surface. Error: usage, for too many levels or points.
Result<> subdivide_by_sqrt3(TriangleSurface surface, unsigned levels, SubdivisionOutput& output);

}  // namespace maille
