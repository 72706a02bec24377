#pragma once

#include <maille/generate.h>
#include <cmath>

namespace maille {

// What positions need, without a library: plain loops whose order of operations is the same everywhere.
inline Position operator+(const Position& a, const Position& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Position operator-(const Position& a, const Position& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Position operator*(double s, const Position& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
inline double dot(const Position& a, const Position& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Position cross(const Position& a, const Position& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Position& a) {
  return std::sqrt(dot(a, a));
}

}  // namespace maille
