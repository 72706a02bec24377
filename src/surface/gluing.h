#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surface/half_edges.h"

namespace maille {

/// Faces over points: `offsets` empty for triangles. No face has fewer than three corners or a point twice;
/// see is_simple().
struct Faces {
  std::span<const uint32_t> corners;
  std::span<const uint32_t> offsets;
  uint32_t point_count = 0;

  uint32_t size() const {
    if (offsets.empty()) return static_cast<uint32_t>(corners.size() / 3);
    return static_cast<uint32_t>(offsets.size() - 1);
  }
  uint32_t first(uint32_t face) const { return offsets.empty() ? 3 * face : offsets[face]; }
  std::span<const uint32_t> face(uint32_t i) const {
    return corners.subspan(first(i), first(i + 1) - first(i));
  }
};

/// Can this face be part of a surface: three or more corners, all different, not too many?
bool is_simple(std::span<const uint32_t> corners);

/// Faces made into a closed oriented surface.
struct GluedSurface {
  /// The faces in their order, each from its first corner, flipped ones backwards; then the border triangles.
  /// Origins are points; those from point_count on are dummies, one for each border loop.
  HalfEdges half_edges;
  uint32_t real_half_edges = 0;
  /// By face: was it turned over, to agree with its neighbours? Empty when none was.
  std::vector<bool> flipped;
  /// Some edge had more than two faces, or two that could not be made to agree: which faces are glued was a
  /// choice, made by a breadth-first walk. Only an order of faces by that same walk repeats it: see
  /// breadth_first_faces().
  bool chosen = false;
  /// No edge has more than one face, or two that run through it in opposite directions.
  bool plain = true;
};
/// Glues faces into an oriented 2-manifold and closes its borders. Faces must be simple (is_simple()), in any
/// orientation and with any number at an edge. Time is linear but for sorting edges by point. The same on
/// every machine. Half-edges: at most four for each corner (border triangles), so corners must stay below
/// most_patch_corners.
GluedSurface glue(const Faces& faces);

/// The real faces of a surface by breadth-first walks over glued edges: from each of `seeds`, in order, round
/// each face from the half-edge by which it was reached, which is what stands for the face in the result.
/// `is_real` tells real faces from border triangles, by half-edge. Both sides order faces so where gluing was
/// a choice, and glue() then makes the same choice again.
std::vector<uint32_t> breadth_first_faces(const HalfEdges& surface, std::span<const uint32_t> seeds,
                                          const std::vector<bool>& is_real);

}  // namespace maille
