#pragma once

#include <string>
#include "workload.h"

namespace maille::bench {

/// What came back, compared up to the order of vertices and faces and to the rotation of faces.
struct Check {
  bool ok = false;      ///< every face with distinct corners is there, at its place, the right way round
  std::string verdict;  ///< "exact", or what was lost or added
};

/// Compares by hashes of positions, so it cannot tell two vertices at the same place apart.
Check check_round_trip(const Surface& original, const Surface& decoded);

/// For codecs that move vertices off the lattice: the same numbers of vertices and faces, and along each axis
/// the corners of all faces, sorted, within `tolerance`. Weaker than check_round_trip.
Check check_within(const Surface& original, const Surface& decoded, double tolerance);

/// `polygons` cut into `triangles`, as a surface of its own.
Surface as_triangles(const Surface& polygons, const std::vector<uint32_t>& triangles);

}  // namespace maille::bench
