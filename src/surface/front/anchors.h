#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surface/vector3.h"

namespace maille {

/// For each of `places` the number of a known place near it: the nearest one, where one is near. (Points that
/// no face uses lie mostly near the surface they were left out of.) None where nothing is known.
std::vector<uint32_t> find_anchors(std::span<const Vector3> known, std::span<const Vector3> places);

}  // namespace maille
