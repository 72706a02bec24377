#pragma once

#include <maille/geometry.h>

#include <algorithm>

namespace maille {

/// From the nearest point of a box; 0 within.
inline double squared_distance(const Vector3& from, const Box& box) {
  double sum = 0;
  for (unsigned k = 0; k < 3; ++k) {
    const double d = std::max({box.low[k] - from[k], from[k] - box.high[k], 0.0});
    sum += d * d;
  }
  return sum;
}

}  // namespace maille
