#pragma once

#include <maille/geometry.h>
#include <pybind11/stl.h>

#include <array>
#include <optional>
#include <utility>
#include <vector>

namespace maille::python {

using Triple = std::array<double, 3>;

/// (low, high) of a box, (centre, radius) of a sphere, half-spaces (normal, offset): as the Python side has
/// them.
using GivenBox = std::optional<std::pair<Triple, Triple>>;
using GivenSphere = std::optional<std::pair<Triple, double>>;
using GivenPlane = std::pair<Triple, double>;
using GivenRegion = std::tuple<GivenBox, GivenSphere, std::vector<GivenPlane>>;

inline Region::Plane plane_of(const GivenPlane& given) {
  return {Vector3{given.first}, given.second};
}

inline Region region_of(const GivenRegion& given) {
  Region region;
  const auto& [box, sphere, planes] = given;
  if (box) region.box = Box{Vector3{box->first}, Vector3{box->second}};
  if (sphere) region.sphere = Sphere{Vector3{sphere->first}, sphere->second};
  for (const GivenPlane& plane : planes) region.planes.push_back(plane_of(plane));
  return region;
}

}  // namespace maille::python
