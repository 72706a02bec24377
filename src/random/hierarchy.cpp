#include "random/hierarchy.h"

#include <cmath>

namespace maille {

Sphere enclosing(const Sphere& a, const Sphere& b) {
  const Vector3 step = b.centre - a.centre;
  const double distance = std::sqrt(dot(step, step));
  if (distance + b.radius <= a.radius) return a;
  if (distance + a.radius <= b.radius) return b;
  const double radius = (distance + a.radius + b.radius) / 2;
  return {a.centre + step * ((radius - a.radius) / distance), radius * (1 + 1e-12)};
}

}  // namespace maille
