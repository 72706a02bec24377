#pragma once

#include <maille/subdivide.h>

#include "predict/triangle_surface.h"

namespace maille {

/// All levels but the last are made in memory. At least one level.
Result<> subdivide_by_sqrt3(TriangleSurface surface, unsigned levels, SubdivisionOutput& output);

}  // namespace maille
