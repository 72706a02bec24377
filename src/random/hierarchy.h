#pragma once

#include <maille/geometry.h>

#include <cstdint>
#include <span>
#include <vector>

namespace maille {

/// The smallest sphere around both, its radius rounded up.
Sphere enclosing(const Sphere& a, const Sphere& b);

inline constexpr uint32_t no_group = 0xffffffff;

/// A piece of the surface that is coded by itself: some thousand faces of one level.
struct Chart {
  uint32_t level = 0;
  uint32_t producer = no_group;     ///< the group whose simplification gave it; none at level 0
  uint32_t consumer = no_group;     ///< the group that it is simplified with; none at the root
  std::vector<uint32_t> faces;      ///< level 0: numbers of the mesh's faces, rising
  std::vector<uint32_t> triangles;  ///< coarser levels: three vertices of the mesh each
  /// Coarser levels of meshes with seams: by corner the corner of the mesh whose values it has, by triangle
  /// the face. See seams.h.
  std::vector<uint32_t> corners, origins;
  Sphere sphere;

  uint64_t face_count() const { return level == 0 ? faces.size() : triangles.size() / 3; }
};

/// Charts of one level, and what they became together in the next coarser one. Vertices at the border of the
/// group stayed, so that it fits its neighbours at both levels: these borders are the wires of Courbet and
/// Hudelot 2009.
struct ChartGroup {
  uint32_t level = 0;  ///< of its inputs
  std::vector<uint32_t> inputs, outputs;
  double view_error =
      0;             ///< for rendering: quadric error, summed along the finer levels; never less than theirs
  double bound = 0;  ///< no point of the mesh is farther from the outputs
  Sphere sphere;     ///< encloses the spheres of its inputs
};

/// Levels of detail: charts and groups, each level a fourth of the faces of the finer one. Level 0 is the
/// mesh, face for face. A set of charts that takes for each group either all outputs or what its inputs are
/// replaced by has no cracks; since errors and spheres grow with the level, any limit on the error as seen
/// chooses such a set: a chart is drawn if its producer's error is within the limit and its consumer's is
/// not.
struct Hierarchy {
  std::vector<Chart> charts;  ///< level after level, the finest first
  std::vector<ChartGroup> groups;

  uint32_t levels() const { return charts.empty() ? 0 : charts.back().level + 1; }
};

}  // namespace maille
