#pragma once

#include <maille/executor.h>

#include <cstdint>
#include <vector>

#include "random/build/spatial_graph.h"

namespace maille {

/// How a graph is cut into parts of about equal weight.
struct CutOptions {
  uint64_t target = 4096;  ///< weight of a part: there are round(weight / target) parts, at least one
  double slack = 0.2;      ///< share by which one side of the last cuts may be off; 0.6 of it in earlier ones
  unsigned axes = 1;       ///< inertial starts: 1 for faces, 3 for charts
};

/// Cuts a graph by recursive bisection, each cut a minimum cut in a band around a cut to start with: across
/// the longest axis of inertia, or around what grows from one end along the edges, which follows layers that
/// are near in space but far on the surface. Large graphs are cut as clusters of nodes first, and the cut is
/// refined. The number of the part by node; parts are numbered along the
/// tree of cuts, left before right, so neighbours in number are mostly neighbours on the surface. Depth is
/// log2 of the number of parts. The same on every machine, for any
/// executor: doubles in fixed order, ties by node number.
std::vector<uint32_t> cut_into_parts(const SpatialGraph& graph, const CutOptions& options,
                                     Executor& executor = serial_executor());

}  // namespace maille
