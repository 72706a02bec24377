#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "random/build/quadric.h"

namespace maille {

/// Triangles of one group, over vertices numbered from 0.
struct SimplifierInput {
  std::span<const uint32_t> triangles;  ///< three corners each
  std::span<const float> positions;     ///< three numbers a vertex
  std::span<const uint8_t> locked;      ///< by vertex: faces outside the group have it, it stays
  uint32_t target = 0;                  ///< triangles wished for
  bool to_the_end = false;              ///< no cap on the error: the coarsest level must become small
  /// By corner: equal numbers at a vertex, equal values. Empty: they do not differ.
  std::span<const uint32_t> values = {};
};

struct Simplified {
  std::vector<uint32_t> triangles;  ///< over the same vertices
  /// By corner left: the one of the input whose values it has, at the vertex where it is now; by triangle
  /// left: the one of the input that it was. Empty without `values`.
  std::vector<uint32_t> corners, faces;
  std::vector<uint32_t> root;  ///< by vertex: the vertex it became; itself if it stayed
  double view_error = 0;       ///< root of the largest quadric error accepted: no bound, see deviation.h
  double lost_component = 0;   ///< half the diagonal of the largest component that vanished
};

/// Removes triangles by half-edge collapses, so that the vertices left are a subset: cheapest first by
/// quadric error (Garland and Heckbert 1997), in passes in which no vertex is touched twice. Takes any
/// triangles: edges with an even number of faces are inside, odd ones are border, along which border vertices
/// slide; there is no link condition, a turned normal is the only guard, since manifoldness gets real meshes
/// stuck. Edges at which values differ from side to side are seams: vertices of these slide along them, and
/// ends of seams stay, as long as that leaves anything to remove. Small components without locked vertices
/// vanish as a whole when they are smaller than the error. May stop above the target where the error would
/// become absurd (0.5 sqrt(area / target)). Deterministic; doubles in fixed order.
Simplified simplify(const SimplifierInput& input);

}  // namespace maille
