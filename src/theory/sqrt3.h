#pragma once

#include <maille/subdivide.h>

#include "theory/triangle_surface.h"

namespace maille {

/// Two levels at a time are made in blocks; an odd one comes first and is made in memory: three times the
/// surface. At least one level.
Result<> subdivide_by_sqrt3(TriangleSurface surface, unsigned levels, SubdivisionOutput& output);

}  // namespace maille
