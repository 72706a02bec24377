#pragma once

#include <array>
#include <cstdint>

#include "surface/patch_surface.h"

namespace maille {

/// A parallelogram with what lies beyond its two other edges: in triangles, the known points across a-w and
/// b-w.
struct WideParallelogram {
  uint32_t a;
  uint32_t b;
  uint32_t across;
  uint32_t tip_a = 0xffffffff;
  uint32_t tip_b = 0xffffffff;
};

/// What the best effort levels know around a vertex before its position, by points; see ElementStencil for
/// the narrow form.
struct Neighbourhood {
  // Parallelograms and neighbours beyond do not count: what is done for a vertex stays bounded. Chosen, not
  // swept.
  static constexpr unsigned most_parallelograms = 8;
  static constexpr unsigned most_ring = 16;

  std::array<WideParallelogram, most_parallelograms> parallelograms;
  std::array<uint32_t, most_ring> ring;  ///< known neighbours
  /// Does the arc of known neighbours end here?
  std::array<bool, most_ring> arc_end;
  unsigned parallelogram_count = 0;
  unsigned ring_count = 0;
  unsigned valence = 0;
  bool border = false;
};

/// Fills `found`, which the caller reuses from vertex to vertex. In the order of turn(), so the same on both
/// sides.
void find_neighbourhood(const PatchSurface& surface, uint32_t vertex, Neighbourhood& found);

}  // namespace maille
