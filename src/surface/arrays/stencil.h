#pragma once

#include <array>
#include <cstdint>

#include "surface/patch_surface.h"

namespace maille {

/// Two known elements on an edge and the known one across it: a + b - across predicts. a = b: straight on.
struct Parallelogram {
  uint32_t a;
  uint32_t b;
  uint32_t across;
};

/// What is known around an element (a point, a corner, a face) when it is coded, by element numbers. The
/// order of parallelograms is that of corners around the element, the same on both sides.
struct ElementStencil {
  static constexpr unsigned most_parallelograms = 5;

  std::array<Parallelogram, most_parallelograms + 1>
      parallelograms;  ///< one to spare, for a search that writes before it knows
  unsigned parallelogram_count = 0;
  uint32_t neighbour = none;  ///< some known element next to it
};

/// The stencil of a vertex among the points of vertices before it. Inside a face of four or more corners the
/// face's own three other known corners make a parallelogram; across an edge, the neighbouring face does.
void find_point_stencil(const PatchSurface& surface, uint32_t vertex, ElementStencil& stencil);

}  // namespace maille
