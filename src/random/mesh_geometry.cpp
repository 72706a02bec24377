#include "random/mesh_geometry.h"

#include <algorithm>

namespace maille {
namespace {

double to_segment(const Vector3& p, const Vector3& a, const Vector3& b) {
  const Vector3 ab = b - a, ap = p - a;
  const double length = dot(ab, ab);
  const double along = length > 0 ? std::min(std::max(dot(ap, ab) / length, 0.0), 1.0) : 0;
  const Vector3 d = ap - ab * along;
  return dot(d, d);
}

}  // namespace

double squared_distance(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 n = cross(b - a, c - a);
  const double area = dot(n, n);
  if (area > 0) {
    const double u = dot(cross(b - a, p - a), n), s = dot(cross(c - b, p - b), n),
                 t = dot(cross(a - c, p - c), n);
    if (u >= 0 && s >= 0 && t >= 0) {
      const double height = dot(p - a, n);
      return height * height / area;
    }
  }
  return std::min({to_segment(p, a, b), to_segment(p, b, c), to_segment(p, c, a)});
}

std::optional<RayHit> ray_hit(const Vector3& origin, const Vector3& direction, const Vector3& a,
                              const Vector3& b, const Vector3& c) {
  const Vector3 ab = b - a, ac = c - a, across = cross(direction, ac);
  const double volume = dot(ab, across);
  if (volume == 0) return std::nullopt;
  const Vector3 from_a = origin - a;
  const double u = dot(from_a, across) / volume;
  const Vector3 turned = cross(from_a, ab);
  const double v = dot(direction, turned) / volume;
  const double distance = dot(ac, turned) / volume;
  if (!(u >= 0 && v >= 0 && u + v <= 1 && distance >= 0)) return std::nullopt;
  return RayHit{distance, u, v};
}

}  // namespace maille
