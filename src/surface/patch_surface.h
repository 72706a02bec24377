#pragma once

#include <cstdint>
#include <vector>

#include "surface/front/connectivity.h"

namespace maille {

/// The surface of a patch as encoder and decoder both have it before the first position. The half-edges are
/// numbered differently on the two sides (as faces lie in the mesh, and as they were coded), everything else
/// is the same. So coders may walk along half-edges, but never count or compare them.
struct PatchSurface {
  HalfEdges half_edges;
  SurfaceVertices vertices;
  /// Number of each vertex's point, in coded order. Vertices of the same point share it.
  /// Empty where every vertex is its own point.
  std::vector<uint32_t> point_of;
  /// Points of the surface: 0 to point_count - 1, in the order of their first vertices.
  uint32_t point_count = 0;
  /// Of each real face the half-edge at which it starts, in coded order. Empty where these are 0, 3, 6 ...,
  /// and where nobody asked for them (border triangles lie between then).
  std::vector<uint32_t> faces;
  uint32_t face_count = 0;

  uint32_t point(uint32_t vertex) const { return point_of.empty() ? vertex : point_of[vertex]; }
  uint32_t face(uint32_t i) const { return faces.empty() ? 3 * i : faces[i]; }
};

}  // namespace maille
