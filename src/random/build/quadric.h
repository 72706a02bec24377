#pragma once

#include "surface/vector3.h"

namespace maille {

/// A weighted sum of squared distances from planes (Garland and Heckbert 1997): for a plane n.p + d = 0 of
/// weight w, w (n.p + d)^2 = p'(w nn')p + 2 w d n.p + w d^2. Sums of quadrics are quadrics, so a vertex
/// remembers all the planes of the vertices that were merged into it in ten numbers.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  Vector3 b{};
  double c = 0;
  double weight = 0;  ///< what distances are divided by for a mean: borders add planes but no weight

  /// The plane through `point` with the unit normal `n`.
  void add_plane(const Vector3& n, const Vector3& point, double w) {
    const double d = -dot(n, point);
    xx += w * n[0] * n[0];
    xy += w * n[0] * n[1];
    xz += w * n[0] * n[2];
    yy += w * n[1] * n[1];
    yz += w * n[1] * n[2];
    zz += w * n[2] * n[2];
    for (unsigned k = 0; k < 3; ++k) b[k] += w * n[k] * d;
    c += w * d * d;
  }
  Quadric& operator+=(const Quadric& o) {
    xx += o.xx;
    xy += o.xy;
    xz += o.xz;
    yy += o.yy;
    yz += o.yz;
    zz += o.zz;
    for (unsigned k = 0; k < 3; ++k) b[k] += o.b[k];
    c += o.c;
    weight += o.weight;
    return *this;
  }
  double at(const Vector3& p) const {
    const double x = xx * p[0] + 2 * (xy * p[1] + xz * p[2] + b[0]);
    const double y = yy * p[1] + 2 * (yz * p[2] + b[1]);
    const double z = zz * p[2] + 2 * b[2];
    return x * p[0] + y * p[1] + z * p[2] + c;
  }
};

}  // namespace maille
