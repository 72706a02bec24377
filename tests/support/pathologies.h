#pragma once

#include "support/random.h"
#include "support/shapes.h"

namespace maille::testing {

/// A surface of one of the base shapes: grids, spheres, tori, plates of genus 0 to 3, random voxels, Moebius
/// strips, Klein bottles, fans, books, soups, single faces, nothing at all, or several of them side by side.
Surface random_shape(Random& random, uint32_t faces);

/// Cuts faces by diagonals and joins neighbours: degrees 3 to 12 and beyond, still the same surface.
void vary_degrees(Surface& surface, Random& random);

/// A few of: holes, flips, duplicate faces, faces glued to edges and points, points merged, split, doubled,
/// isolated, ...
void mutilate(Surface& surface, Random& random, bool degenerate_faces);

}  // namespace maille::testing
