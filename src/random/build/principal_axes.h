#pragma once

#include <array>

#include "random/build/spatial_graph.h"

namespace maille {

/// Axes of inertia of the nodes' places, the longest extent first; ties in the order of the coordinates. By
/// Jacobi's method (1846) with + - * / and sqrt only, so the same on every machine.
std::array<std::array<double, 3>, 3> principal_axes(const SpatialGraph& graph);

}  // namespace maille
