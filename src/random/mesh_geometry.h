#pragma once

#include <maille/geometry.h>
#include <maille/mesh.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "mesh/box_distance.h"
#include "numbers/point_position.h"

namespace maille {

/// A vertex of three floats, numbers that are none counting as 0: orders and boxes need some place.
inline Vector3 finite_position(std::span<const float> positions, uint32_t vertex) {
  Vector3 p;
  for (unsigned k = 0; k < 3; ++k) {
    const auto x = static_cast<double>(positions[size_t{3} * vertex + k]);
    p[k] = std::isfinite(x) ? x : 0;
  }
  return p;
}

/// Extends a box to a point, likewise finite; `first`: it holds nothing yet.
inline void enclose(Box& box, const Vector3& point, bool first) {
  for (unsigned k = 0; k < 3; ++k) {
    const double x = std::isfinite(point[k]) ? point[k] : 0;
    box.low[k] = first ? x : std::min(box.low[k], x);
    box.high[k] = first ? x : std::max(box.high[k], x);
  }
}

/// A polygon as triangles: calls f(a, b, c). The fan starts at the lowest corner, whichever is the first: a
/// file may turn polygons, and those that are bent must not change with that.
template <class F>
void for_each_fan_triangle(const Array& positions, std::span<const uint32_t> nodes, F f) {
  size_t start = 0;
  for (size_t i = 1; i < nodes.size(); ++i) {
    if (point_position(positions, nodes[i]).x < point_position(positions, nodes[start]).x) start = i;
  }
  const auto corner = [&](size_t i) { return nodes[(start + i) % nodes.size()]; };
  for (size_t k = 2; k < nodes.size(); ++k) f(corner(0), corner(k - 1), corner(k));
}

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
