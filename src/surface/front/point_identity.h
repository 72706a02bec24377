#pragma once

#include <maille/error.h>
#include <maille/source.h>

#include <cstdint>
#include <span>
#include <vector>

#include "surface/front/connectivity.h"

namespace maille {

/// Which vertices of a surface are one point. Most points have one vertex; where several fans of faces meet
/// in a point, or faces lie twice, each later vertex is coded as a copy of an earlier one's point.
///
/// `original` gives the mesh's point for each vertex. Returns the coded bytes, empty when no point has two
/// vertices. `point_of` gets the numbers of points in coded order; it stays empty when each vertex is its own
/// point.
std::vector<std::byte> encode_point_identity(const HalfEdges& surface, const SurfaceVertices& vertices,
                                             std::span<const uint32_t> original,
                                             std::vector<uint32_t>& point_of, uint32_t& point_count);

/// Inverse. Safe on any bytes: each vertex is a new point or one that is there. Error: corrupt.
Result<> decode_point_identity(const HalfEdges& surface, const SurfaceVertices& vertices, Bytes bytes,
                               std::vector<uint32_t>& point_of, uint32_t& point_count);

}  // namespace maille
