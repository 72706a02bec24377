#pragma once

#include <array>
#include <optional>
#include <vector>

namespace maille {

/// A point or direction in space.
struct Vector3 {
  std::array<double, 3> x = {};
  double& operator[](unsigned k) { return x[k]; }
  double operator[](unsigned k) const { return x[k]; }
};

inline Vector3 operator+(const Vector3& a, const Vector3& b) {
  return {{a[0] + b[0], a[1] + b[1], a[2] + b[2]}};
}
inline Vector3 operator-(const Vector3& a, const Vector3& b) {
  return {{a[0] - b[0], a[1] - b[1], a[2] - b[2]}};
}
inline Vector3 operator*(const Vector3& a, double s) {
  return {{a[0] * s, a[1] * s, a[2] * s}};
}
inline double dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vector3 cross(const Vector3& a, const Vector3& b) {
  return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}

struct Sphere {
  Vector3 centre;
  double radius = 0;
};

/// With sides along the axes; sides belong to it.
struct Box {
  Vector3 low, high;
};

/// Where parts of a mesh are wanted: the intersection of all that is given; everywhere where nothing is said.
/// In the units of the mesh's positions.
struct Region {
  std::optional<Box> box;
  std::optional<Sphere> sphere;
  /// A half-space: normal.x + offset >= 0 inside. A frustum has six.
  struct Plane {
    Vector3 normal;  ///< of length 1
    double offset = 0;
  };
  std::vector<Plane> planes;

  /// May the region have a point of it? False is sure; true may be wrong where box, sphere and planes are met
  /// each, but nowhere together.
  bool meets(const Sphere& other) const;
  bool meets(const Box& other) const;
};

}  // namespace maille
