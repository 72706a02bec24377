#include <maille/geometry.h>

#include <algorithm>
#include <cmath>

#include "mesh/box_distance.h"

namespace maille {
namespace {

double length(const Vector3& v) {
  return std::sqrt(dot(v, v));
}

}  // namespace

/// Tests of pairs: true may be wrong where a box and a plane are met apart but not together, false never is.
/// Callers (charts, pieces) ask whether something may be left out.
bool Region::meets(const Sphere& other) const {
  if (box && std::sqrt(squared_distance(other.centre, *box)) > other.radius) return false;
  if (sphere && length(sphere->centre - other.centre) > sphere->radius + other.radius) return false;
  return std::all_of(planes.begin(), planes.end(), [&](const Plane& plane) {
    return dot(plane.normal, other.centre) + plane.offset >= -other.radius;
  });
}

bool Region::meets(const Box& other) const {
  for (unsigned k = 0; k < 3 && box; ++k) {
    if (box->high[k] < other.low[k] || box->low[k] > other.high[k]) return false;
  }
  if (sphere && std::sqrt(squared_distance(sphere->centre, other)) > sphere->radius) return false;
  return std::all_of(planes.begin(), planes.end(), [&](const Plane& plane) {
    // The corner of the box that is farthest along the normal decides.
    double farthest = plane.offset;
    for (unsigned k = 0; k < 3; ++k)
      farthest += plane.normal[k] * (plane.normal[k] > 0 ? other.high[k] : other.low[k]);
    return farthest >= 0;
  });
}

}  // namespace maille
