#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/none.h"

// Triangles with neighbours, for subdivision. Half-edge h runs from corner h to the next corner of its
// triangle.
namespace maille {

using Position = std::array<double, 3>;

/// An oriented surface of triangles, with borders. Every edge has one or two triangles; points may be
/// isolated. Made by triangle_surface(), which refuses everything else.
struct TriangleSurface {
  static constexpr uint32_t border = none;

  std::vector<Position> points;
  std::vector<uint32_t> corners;   ///< three for each triangle
  std::vector<uint32_t> opposite;  ///< by half-edge: that of the neighbour, or border

  static uint32_t next(uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static uint32_t previous(uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }
  uint32_t half_edges() const { return static_cast<uint32_t>(corners.size()); }
  uint32_t triangles() const { return half_edges() / 3; }
  uint32_t origin(uint32_t h) const { return corners[h]; }
  uint32_t target(uint32_t h) const { return corners[next(h)]; }
  uint32_t tip(uint32_t h) const { return corners[previous(h)]; }
  /// The next half-edge from the same origin, counter-clockwise; border behind the last.
  uint32_t turn(uint32_t h) const { return opposite[previous(h)]; }
  /// True for one half-edge of each edge: the lower one, or the only one, as `border` is above all numbers.
  bool is_first(uint32_t h) const { return opposite[h] > h; }
};

/// Finds the neighbours of triangles. Error: malformed_input, for an edge of more than two triangles, or of
/// two that run along it in the same direction.
Result<> find_opposites(TriangleSurface& surface);

/// The triangles of a mesh. Errors: malformed_input, see subdivide().
Result<TriangleSurface> triangle_surface(const Mesh& mesh);

}  // namespace maille
