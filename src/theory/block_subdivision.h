#pragma once

#include <maille/subdivide.h>

#include <array>
#include <span>

#include "theory/subdivision_point.h"
#include "theory/surface_block.h"

// Subdivision that makes a regular lattice of every triangle, block by block.
namespace maille {

/// A place in a triangle: steps from the first corner towards the second and the third.
struct Place {
  int32_t i;
  int32_t j;
};

/// A scheme that cuts every edge in `steps` each time, and so makes steps^2 triangles of one.
struct BlockScheme {
  int32_t steps;
  std::span<const std::array<Place, 3>> parts;  ///< corners of the new triangles of one, in their order
  std::vector<double> (*ring_weights)(unsigned valence);
  unsigned rings;  ///< what has to be around a block
  /// Subdivides the inner triangles of a block once, with so many rings around them: `rings` or 0.
  SurfaceBlock (*refined)(const SurfaceBlock& block, RingWeights& weights, unsigned rings);
};

/// Writes the surface subdivided `levels` times to `output`: first all points, then all triangles. Memory is
/// that of the surface, and a block of about a million triangles of the result, or those of one triangle.
/// Errors: usage, for more points than a mesh can have; those of `output`.
Result<> subdivide_in_blocks(const TriangleSurface& surface, unsigned levels, const BlockScheme& scheme,
                             SubdivisionOutput& output);

}  // namespace maille
