#pragma once

// Shapes for tests of whatever goes over a surface.

#include <vector>

#include "support/half_edges.h"

namespace maille::testing {

/// Closed ones, with borders, with holes, in several pieces, of genus, with arms to go round.
inline std::vector<Surface> named_shapes() {
  Surface several = shapes::cube();
  append(several, shapes::tetrahedron());
  append(several, shapes::torus(4, 4));
  append(several, shapes::grid(2, 2));
  return {shapes::tetrahedron(),
          shapes::cube(),
          shapes::torus(7, 5),
          shapes::grid(1, 1),
          shapes::grid(6, 4),
          shapes::cylinder(5, 2),
          with_holes(),
          several,
          star(),
          shapes::plate(3),
          shapes::sphere(9, 6)};
}

}  // namespace maille::testing
