#pragma once

#include <maille/executor.h>
#include <maille/mesh.h>

#include <vector>

#include "surface/parts/shared_points.h"

namespace maille {

/// The mesh that was cut into these parts: in each block the cells of part after part, points numbered as
/// `joined` says. All parts have the same blocks and arrays, and there is one at least; arrays that belong to
/// the mesh as a whole are taken from the first. Positions of joined points are those of the first part that
/// has them.
Mesh merge_parts(std::vector<Mesh> parts, const JoinedPoints& joined, Executor& executor);

}  // namespace maille
