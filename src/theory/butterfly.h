#pragma once

#include <maille/subdivide.h>

#include "theory/triangle_surface.h"

namespace maille {

/// The modified butterfly (Zorin, Schroeder and Sweldens 1996), at least one level: each triangle becomes
/// four. Memory is that of the surface, and a block of about a million triangles of the result. Error: usage,
/// for too many levels or points.
Result<> subdivide_by_butterfly(const TriangleSurface& surface, unsigned levels, SubdivisionOutput& output);

}  // namespace maille
