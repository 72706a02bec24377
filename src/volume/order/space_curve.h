#pragma once

#include <array>
#include <cstdint>

namespace maille {

/// Where a point of a cube with 2^20 places a side lies on Hilbert's curve, which fills it without jumps.
///
/// The curve is walked from the largest octants to the smallest. Each level, `axes` and the flips say how the
/// pattern of eight octants is turned there; the octants come in the order of a Gray code of three bits.
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

}  // namespace maille
