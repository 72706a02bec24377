#include "mesh/cell_turns.h"

#include <maille/faces.h>

#include <algorithm>
#include <vector>

namespace maille {
namespace {

unsigned corners_on(const FacesOfSolid& faces, unsigned i) {
  unsigned corners = 0;
  for (const uint8_t corner : faces.face(i)) corners |= 1u << corner;
  return corners;
}

/// A bit for each corner that an edge joins to this one.
unsigned joined_to(const FacesOfSolid& faces, unsigned corner) {
  unsigned joined = 0;
  for (unsigned i = 0; i < faces.count; ++i) {
    const auto face = faces.face(i);
    for (size_t k = 0; k < face.size(); ++k) {
      const uint8_t next = face[(k + 1) % face.size()];
      if (face[k] == corner) joined |= 1u << next;
      if (next == corner) joined |= 1u << face[k];
    }
  }
  return joined;
}

/// Face 0 is put on another one, and each corner beside it where the same edge leads from there. In these
/// solids a corner that is not on face 0 has exactly one edge to it (the tip of a pyramid or tetrahedron
/// several, which all lead to the same corner), and the image of that edge is the only one that leaves the
/// other face there.
CellTurn turned(const FacesOfSolid& faces, unsigned corners, unsigned onto, unsigned by) {
  CellTurn turn;
  const auto from = faces.face(0), to = faces.face(onto);
  for (size_t k = 0; k < from.size(); ++k) turn.corner[from[k]] = to[(k + by) % to.size()];
  const unsigned here = corners_on(faces, 0), there = corners_on(faces, onto);
  for (unsigned c = 0; c < corners; ++c) {
    if ((here >> c & 1) != 0) continue;
    const auto below = static_cast<unsigned>(__builtin_ctz(joined_to(faces, c) & here));
    const unsigned above = joined_to(faces, turn.corner[below]) & ~there;
    turn.corner[c] = static_cast<uint8_t>(__builtin_ctz(above));
  }
  for (unsigned f = 0; f < faces.count; ++f) {
    unsigned image = 0;
    for (const uint8_t corner : faces.face(f)) image |= 1u << turn.corner[corner];
    while (corners_on(faces, turn.face[f]) != image) ++turn.face[f];
  }
  return turn;
}

std::vector<CellTurn> turns_of_solid(CellType type, unsigned corners) {
  const FacesOfSolid& faces = faces_of(type);
  std::vector<CellTurn> turns;
  for (unsigned onto = 0; onto < faces.count; ++onto) {
    // Only faces of the same size can take the place of face 0: the base of a pyramid, the two triangles of a
    // wedge.
    if (faces.sizes[onto] != faces.sizes[0]) continue;
    for (unsigned by = 0; by < faces.sizes[0]; ++by) turns.push_back(turned(faces, corners, onto, by));
  }
  return turns;
}

/// Rotations only: a face that is mirrored is seen from its other side, which is another face.
std::vector<CellTurn> turns_of_polygon(unsigned corners) {
  std::vector<CellTurn> turns(corners);
  for (unsigned by = 0; by < corners; ++by) {
    for (unsigned k = 0; k < corners; ++k)
      turns[by].corner[k] = turns[by].face[k] = static_cast<uint8_t>((k + by) % corners);
  }
  return turns;
}

}  // namespace

// Made on first use, which C++ makes safe for threads. Types that are not here have one turn, the one they
// have.
std::span<const CellTurn> turns_of(CellType type) {
  static const std::vector<CellTurn> of_triangles = turns_of_polygon(3), of_quads = turns_of_polygon(4),
                                     of_tetrahedra = turns_of_solid(CellType::tetrahedron, 4),
                                     of_pyramids = turns_of_solid(CellType::pyramid, 5),
                                     of_wedges = turns_of_solid(CellType::wedge, 6),
                                     of_hexahedra = turns_of_solid(CellType::hexahedron, 8);
  switch (type) {
    case CellType::triangle:
      return of_triangles;
    case CellType::quad:
      return of_quads;
    case CellType::tetrahedron:
      return of_tetrahedra;
    case CellType::pyramid:
      return of_pyramids;
    case CellType::wedge:
      return of_wedges;
    case CellType::hexahedron:
      return of_hexahedra;
    default:
      return {};
  }
}

}  // namespace maille
