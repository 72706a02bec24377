#pragma once

#include <maille/geometry.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace maille {

/// Where a point of a cube with 2^20 places a side lies on Hilbert's curve, which fills it without jumps.
///
/// Three bits of the place belong to each level, from the largest octants to the smallest; the octants of a
/// level come in the order of a Gray code, turned so that the curve goes on where the octant before has
/// ended.
inline uint64_t place_on_curve(std::array<uint32_t, 3> point) {
  constexpr uint32_t top = uint32_t{1} << 19;
  // From coordinates to the bits of the place, transposed: J. Skilling, "Programming the Hilbert curve",
  // 2004.
  for (uint32_t bit = top; bit > 1; bit >>= 1) {
    const uint32_t below = bit - 1;
    for (uint32_t& axis : point) {
      if ((axis & bit) != 0) {
        point[0] ^= below;
      } else {
        const uint32_t swapped = (point[0] ^ axis) & below;
        point[0] ^= swapped;
        axis ^= swapped;
      }
    }
  }
  point[1] ^= point[0];
  point[2] ^= point[1];
  uint32_t flip = 0;
  for (uint32_t bit = top; bit > 1; bit >>= 1) {
    if ((point[2] & bit) != 0) flip ^= bit - 1;
  }
  uint64_t place = 0;
  for (uint32_t bit = top; bit != 0; bit >>= 1) {
    for (const uint32_t axis : point) place = place << 1 | (((axis ^ flip) & bit) != 0 ? 1 : 0);
  }
  return place;
}

/// The same of a point that is so many places from the cube's lowest corner; beyond its sides it is on them,
/// NaN on the lowest.
inline uint64_t place_on_curve(const Vector3& places) {
  std::array<uint32_t, 3> at{};
  for (unsigned k = 0; k < 3; ++k)
    at[k] = places[k] > 0 ? static_cast<uint32_t>(std::min(places[k], 1048575.0)) : 0;
  return place_on_curve(at);
}

/// Puts elements into the order in which Hilbert's curve through the cube around them passes their places, so
/// that each is near the one before; those at one place in ascending order. Places are finite. places[i] is
/// that of elements[i] before the call; both have one size. Takes 16 bytes an element, and the time of a
/// sort.
template <class Number>
void sort_along_curve(std::span<const Vector3> places, std::span<Number> elements) {
  if (elements.empty()) return;
  Vector3 low = places[0], high = places[0];
  for (const Vector3& place : places) {
    for (unsigned k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], place[k]);
      high[k] = std::max(high[k], place[k]);
    }
  }
  const Vector3 size = high - low;
  const double widest = std::max({size[0], size[1], size[2]});
  const double scale = widest > 0 ? 1048575.0 / widest : 0;
  std::vector<std::pair<uint64_t, Number>> order(elements.size());
  for (size_t i = 0; i < elements.size(); ++i) {
    // Not finite where the places lie within less than 1e-300.
    order[i] = {place_on_curve((places[i] - low) * scale), elements[i]};
  }
  std::sort(order.begin(), order.end());
  for (size_t i = 0; i < elements.size(); ++i) elements[i] = order[i].second;
}

}  // namespace maille
