#pragma once

#include <maille/executor.h>
#include <maille/mesh.h>

#include <span>
#include <vector>

#include "random/chart_codec.h"
#include "surface/parts/joins.h"

namespace maille {

/// By chart of level 0 the points that others have as well. `points` are theirs in the whole mesh, by chart
/// and coded point; `positions`: the array as the decoder will have it, by point of the whole mesh. Points of
/// one position are numbered in the order of the whole mesh.
std::vector<std::vector<SharedPoint>> find_shared(std::span<const std::span<const uint32_t>> points,
                                                  const std::vector<Place>& places);

/// A position as its bits: what shared points are known by.
Place place_of(const Array& positions, uint32_t point);

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
