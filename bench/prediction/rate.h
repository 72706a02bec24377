#pragma once

#include <vector>

#include "triangles.h"

namespace maille::bench {

/// Bits that the codec's own coder of residuals takes for each vector: adaptive models of the number of
/// significant bits, then of the sign and the next three, the rest raw; no context but the coordinate.
double bits_per_vertex(const std::vector<Point>& residuals);

}  // namespace maille::bench
