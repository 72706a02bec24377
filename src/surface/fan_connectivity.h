#pragma once

#include <maille/error.h>
#include <maille/source.h>

#include <array>
#include <cstdint>
#include <vector>

#include "base/unfilled.h"
#include "surface/half_edges.h"

namespace maille {

/// Connectivity of triangles for decoding near memory speed: a ring of vertices grows around the coded
/// triangles, and one symbol tells how the fan around the vertex at its head is completed.
/// docs/format.md, "Fans".

/// Vertices whose positions predict that of another one, in coded order. See fan_positions.h.
///
///            A ---- vertex          closed fans end at N; O2 is beyond the edge from focus to N.
///           / \    /  |             The late triple is a parallelogram that became known
///          B   focus  |             after the vertex: late[0] + late[1] - late[2].
///               | \   |
///               |   \ |
///               O2 --- N
struct VertexReferences {
  enum : unsigned { focus, next, next_opposite, late, before = 6, last = 7, count = 8 };
  std::array<uint32_t, count> at;
};

/// Where in its fan a vertex stands, the valence of the focus, and whether there is a late triple.
inline constexpr unsigned fan_places = 14;
inline constexpr unsigned first_open_place = 10;
inline constexpr unsigned start_place = 13;
inline constexpr unsigned valence_classes = 6;
inline constexpr unsigned vertex_kinds = fan_places * valence_classes * 2;
inline constexpr unsigned place_of_kind(unsigned kind) {
  return kind / (2 * valence_classes);
}
inline constexpr bool kind_has_late(unsigned kind) {
  return (kind & 1) != 0;
}
/// Is it the last vertex of a closed fan, so that the next triangle is known on both sides?
inline constexpr bool kind_is_last(unsigned kind) {
  const unsigned place = place_of_kind(kind);
  return place == 0 || place == 2 || place == 5 || place == 9;
}

/// Triangles in coded order. Vertices are numbered by their first corners.
struct FanSurface {
  std::vector<uint32_t> corners;  ///< three for each triangle
  uint32_t vertices = 0;
  Unfilled<VertexReferences> references;  ///< by vertex
  Unfilled<uint8_t> kinds;                ///< by vertex

  uint32_t triangles() const { return static_cast<uint32_t>(corners.size() / 3); }
};

struct EncodedFans {
  FanSurface surface;
  std::vector<uint32_t> points;      ///< by vertex: its number in `origin` of what was encoded
  std::vector<uint32_t> half_edges;  ///< by triangle: the half-edge at its first corner
  std::vector<std::byte> bytes;
};

/// Points have numbers of this many bits at most.
inline constexpr unsigned fan_point_bits = 28;
inline constexpr uint32_t most_fan_points = 1u << fan_point_bits;

/// Codes the real triangles of a closed surface, see gluing.h: all faces are triangles, the first
/// `real_half_edges` half-edges belong to real ones. Origins are points,
/// at most most_fan_points; several vertices of the surface may be one point.
EncodedFans encode_fans(const HalfEdges& surface, uint32_t real_half_edges, uint32_t point_count);

/// Inverse. Safe on any bytes: `triangles` triangles over at most `most_vertices` vertices, or corrupt. Work
/// is bounded by the size of the bytes and by `triangles`.
Result<FanSurface> decode_fans(Bytes bytes, uint32_t triangles, uint32_t most_vertices);

}  // namespace maille
