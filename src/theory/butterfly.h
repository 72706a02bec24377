#pragma once

#include <maille/subdivide.h>

#include "theory/triangle_surface.h"

namespace maille {

/// Memory is that of the surface, and a block of about a million triangles of the result. At least one level.
Result<> subdivide_by_butterfly(const TriangleSurface& surface, unsigned levels, SubdivisionOutput& output);

}  // namespace maille
