#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surface/fans/fan_connectivity.h"
#include "surface/patch_surface.h"

namespace maille {

/// The faces of a patch in coded order, by corners, as arrays see them: the same on both sides, however the
/// connectivity was coded. docs/format.md, 13.2.
struct CornerFaces {
  std::vector<uint32_t> points;   ///< by corner
  std::vector<uint32_t> offsets;  ///< of the corners of each face, and their end; empty: triangles
  /// By corner, for the edge from it to the next one of its face: the corner from which the face on the other
  /// side runs along it; none where there is no such face.
  std::vector<uint32_t> opposite;
  std::vector<uint32_t> following, preceding;  ///< corners of the same face; empty: triangles
  /// The number of each corner in PatchElements; empty: the same.
  std::vector<uint32_t> number;
  uint32_t point_count = 0;

  uint32_t faces() const {
    return static_cast<uint32_t>(offsets.empty() ? points.size() / 3 : offsets.size() - 1);
  }
  uint32_t first(uint32_t face) const { return offsets.empty() ? 3 * face : offsets[face]; }
  uint32_t corners() const { return static_cast<uint32_t>(points.size()); }
  uint32_t next(uint32_t c) const {
    if (!following.empty()) return following[c];
    return c % 3 == 2 ? c - 2 : c + 1;
  }
  uint32_t previous(uint32_t c) const {
    if (!preceding.empty()) return preceding[c];
    return c % 3 == 0 ? c + 2 : c - 1;
  }
  /// Fills `number` for a surface in which these faces run the other way: they keep their first corner, the
  /// others change places.
  void flip(const std::vector<bool>& flipped);
  bool is_triangle(uint32_t c) const { return following.empty() || next(next(next(c))) == c; }
  uint32_t number_of(uint32_t c) const { return number.empty() ? c : number[c]; }
};

/// From fans corners are numbered as they are, from half-edges each face begins at its lowest vertex: in each
/// case what both sides have.
CornerFaces corner_faces(const FanSurface& fans);
CornerFaces corner_faces(const PatchSurface& surface);

/// References, kinds and valences of elements on corners, for the coder of positions: `element` by corner,
/// numbers below `count`. No faces are in the result. Damaged faces, with an element twice, do no harm.
FanSurface element_references(const CornerFaces& faces, std::span<const uint32_t> element, uint32_t count);
/// The same of the faces themselves.
FanSurface face_references(const CornerFaces& faces);

}  // namespace maille
