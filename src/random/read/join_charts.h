#pragma once

#include <maille/executor.h>
#include <maille/mesh.h>

#include <span>
#include <vector>

#include "random/chart_codec.h"
#include "surface/parts/shared_points.h"

namespace maille {

class RandomReader;

/// Numbers for the points of charts of level 0 that were decoded, in their order: shared points of one
/// position and copy are one.
JoinedPoints join_charts(std::span<const DecodedChart> charts);

/// Charts of level 0 as one mesh, with all blocks and arrays; of no charts a mesh without cells. `problems`:
/// not null: if arrays of the mesh as a whole are damaged, they are left out, and it is told there. Errors:
/// also those of the source.
Result<Mesh> join_finest(std::vector<DecodedChart> charts, const RandomReader& reader,
                         const DecodeOptions& options, std::vector<std::string>* problems);

/// Charts of any levels as one mesh of triangles (or of polygons, where charts of level 0 have such), with
/// arrays of points, cells and corners: points of equal position and values are one. Names of blocks and
/// arrays of the mesh as a whole are left out.
Mesh join_levels(std::span<const DecodedChart> charts);

}  // namespace maille
