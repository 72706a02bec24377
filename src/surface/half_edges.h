#pragma once

#include <cstdint>
#include <vector>

#include "mesh/none.h"

namespace maille {

/// Vertices from this number on are dummies: they close border loops and stand for no point. Real ones stay
/// below, as a closed surface of fewer than 2^31 half-edges has fewer than 2^30 vertices.
inline constexpr uint32_t first_dummy = 0x40000000;
/// Faces with more edges are not part of a surface; they are coded as loose cells. The format's limit
/// (section 11), which keeps work for a face bounded.
inline constexpr uint32_t max_degree = 0xffff;

/// Faces as half-edges, next to each other face after face; half-edge h runs from origin[h] to
/// origin[next(h)]. Opposite half-edges of neighbouring faces are glued. The surface is an oriented
/// 2-manifold and, once closed, has no border: see close_borders().
///
///                origin[next(h)]
///                  /|\        .
///          face   / | \       .       left of h: its own face, right of it: the face of opposite[h]
///             prev  h  opposite
///                 \ | /
///                  \|/
///                origin[h]
struct HalfEdges {
  std::vector<uint32_t> origin;
  std::vector<uint32_t> opposite;
  /// The following half-edge of the same face. Empty when every face is a triangle.
  std::vector<uint32_t> following;

  bool all_triangles() const { return following.empty(); }
  uint32_t size() const { return static_cast<uint32_t>(origin.size()); }

  uint32_t next(uint32_t h) const {
    if (!following.empty()) return following[h];
    return h % 3 == 2 ? h - 2 : h + 1;
  }
  uint32_t previous(uint32_t h) const {
    if (following.empty()) return h % 3 == 0 ? h + 2 : h - 1;
    // Within a face numbers grow by one, so only its first half-edge has to look for the last.
    if (h > 0 && following[h - 1] == h) return h - 1;
    uint32_t last = h;
    while (following[last] != h) ++last;
    return last;
  }
  /// The next corner of the same vertex, turning over the edge before h. In a closed surface it comes back to
  /// h.
  uint32_t turn(uint32_t h) const { return opposite[previous(h)]; }
  /// Counts; who needs it for all faces lists them once.
  unsigned degree(uint32_t h) const {
    if (following.empty()) return 3;
    unsigned edges = 1;
    for (uint32_t e = following[h]; e != h; e = following[e]) ++edges;
    return edges;
  }
  /// Of the triangle that starts at h: has it a dummy?
  bool is_border_triangle(uint32_t h) const {
    return origin[h] >= first_dummy || origin[h + 1] >= first_dummy || origin[h + 2] >= first_dummy;
  }
  void glue(uint32_t a, uint32_t b) {
    opposite[a] = b;
    opposite[b] = a;
  }
};

}  // namespace maille
