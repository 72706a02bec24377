#pragma once

#include <maille/executor.h>
#include <maille/mesh.h>

#include <span>
#include <vector>

#include "random/chart_codec.h"
#include "surface/parts/shared_points.h"

namespace maille {

/// Numbers for the points of charts of level 0 that were decoded, in their order: shared points of one
/// position and copy are one.
JoinedPoints join_charts(std::span<const DecodedChart> charts);

/// A chart of level 0 without any cells or points.
DecodedChart empty_chart(const Description& description, const DecodeOptions& options);

/// Charts of level 0 as one mesh, with all blocks and arrays. Error: usage, for none.
Result<Mesh> join_finest(std::vector<DecodedChart> charts, const Description& description,
                         Executor& executor);

/// Charts of any levels as one mesh of triangles (or of polygons, where charts of level 0 have such), with
/// arrays of points, cells and corners: points of equal position and values are one. Names of blocks and
/// arrays of the mesh as a whole are left out.
Mesh join_levels(std::span<const DecodedChart> charts);

}  // namespace maille
