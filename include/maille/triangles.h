#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <vector>

namespace maille {

/// The index buffer of a mesh for graphics: three points for each triangle, in the order of the cells.
/// Polygons are fans around their first corner, quadratic faces have their corners only; cells that are no
/// faces have no triangles. The mesh must be valid (validate()), as what decode() and readers return.
std::vector<uint32_t> triangle_indices(const Mesh& mesh);
/// Its vertex buffer: x, y and z of each point as floats, rounded where the mesh has other numbers.
std::vector<float> positions_as_floats(const Mesh& mesh);

}  // namespace maille
