#pragma once

#include <cstdint>
#include <span>

#include "random/build/simplifier.h"

namespace maille {

/// How far the vertices that a simplification removed are from the triangles it left; of a vertex whose
/// component vanished, its distance from where it was merged to. Of triangles at the border also their
/// middles and the middles of their edges against the input: they may span a bay. Exact up to rounding,
/// rounded up.
double deviation(const SimplifierInput& input, const Simplified& simplified);

}  // namespace maille
