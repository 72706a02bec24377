#pragma once

#include <maille/geometry.h>
#include <maille/mesh.h>

#include <optional>

namespace maille {

/// A point's position, whatever its type. Numbers that are none stay so.
Vector3 point_position(const Array& positions, uint64_t point);

/// From the nearest point of a triangle.
double squared_distance(const Vector3& from, const Vector3& a, const Vector3& b, const Vector3& c);

/// Where a ray meets a triangle (Moeller and Trumbore 1997): distance in lengths of `direction`, and the
/// weights of b and c. Nothing behind the origin.
struct RayHit {
  double distance, b, c;
};
std::optional<RayHit> ray_hit(const Vector3& origin, const Vector3& direction, const Vector3& a,
                              const Vector3& b, const Vector3& c);

}  // namespace maille
