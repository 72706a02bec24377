#pragma once

#include <maille/mesh.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

#include "base/wide_integer.h"
#include "numbers/number_map.h"

namespace maille {

/// Position of a double among half octaves: floor(2 log2(x)), from -126 to 126. The mantissa is compared with
/// that of sqrt(2) (0x6a09e667f3bcc), so that nothing is computed that machines could round differently.
[[gnu::always_inline]] inline int half_octave(double x) {
  if (!(x > 1e-18)) return -126;
  if (x > 1e18) return 126;
  uint64_t bits;
  __builtin_memcpy(&bits, &x, 8);
  const int exponent = static_cast<int>(bits >> 52) - 1023;
  return 2 * exponent + static_cast<int>((bits & 0xfffffffffffff) >= 0x6a09e667f3bcc);
}

/// The bin of a number, of `count` that begin at `low`; those at the ends take all that is beyond.
inline unsigned clamp_bin(int bin, int low, int count) {
  const int place = bin - low;
  return static_cast<unsigned>(place < 0 ? 0 : place >= count ? count - 1 : place);
}

/// The size of a code of this map in the numbers' own unit; 1 for floats in order, where it varies.
inline double step_of(const NumberMap& map) {
  switch (map.kind) {
    case NumberMap::Kind::lattice:
      return map.step;
    case NumberMap::Kind::decimal: {
      // Divided step by step, as pow() differs between machines.
      double step = 1;
      for (int32_t i = 0; i < map.exponent; ++i) step /= 10;
      return map.factor == 0 ? step : step * map.factor;
    }
    case NumberMap::Kind::binary:
      return std::ldexp(map.factor == 0 ? 1 : map.factor, map.exponent);
    default:
      return 1;
  }
}

/// The codes of positions, three for each point, and the numbers they stand for, up to an offset, in units.
template <class Code>
class PositionCodes {
 public:
  using Wide = std::conditional_t<sizeof(Code) == 4, int64_t, WideInteger>;
  static constexpr Wide lowest = std::numeric_limits<Code>::min();
  static constexpr Wide highest = std::numeric_limits<Code>::max();

  PositionCodes(Scalar type, std::span<const NumberMap> maps, double unit, std::span<Code> codes)
      : type_(type), unit_(unit), codes_(codes) {
    for (unsigned k = 0; k < 3; ++k) {
      curved_[k] = maps[k].is_curved() ? &maps[k] : nullptr;
      low_end_[k] = maps[k].table.empty() ? lowest : Wide{0};
      high_end_[k] = maps[k].table.empty() ? highest : static_cast<Wide>(maps[k].table.size() - 1);
      step_[k] = step_of(maps[k]) / unit;
      inverse_step_[k] = 1 / step_[k];
    }
  }

  static size_t at(uint32_t point, unsigned axis) { return size_t{point} * 3 + axis; }
  Code& of(uint32_t point, unsigned axis) const { return codes_[at(point, axis)]; }
  size_t size() const { return codes_.size(); }

  /// Of the codes that there are on an axis.
  Wide low_end(unsigned axis) const { return low_end_[axis]; }
  Wide high_end(unsigned axis) const { return high_end_[axis]; }
  bool has(Wide code, unsigned axis) const { return code >= low_end_[axis] && code <= high_end_[axis]; }

  double value(Wide code, unsigned axis) const {
    if (!curved_[axis]) return static_cast<double>(code) * step_[axis];
    return curved_value(code, axis);
  }
  /// Half way from the code before to this one.
  [[gnu::always_inline]] double boundary(Wide code, unsigned axis) const {
    if (!curved_[axis]) return (static_cast<double>(code) - 0.5) * step_[axis];
    return (curved_value(code - 1, axis) + curved_value(code, axis)) * 0.5;
  }
  /// From this code to the next.
  double step(Wide code, unsigned axis) const {
    if (!curved_[axis]) return step_[axis];
    return std::fabs(value(code + (code < highest ? 1 : 0), axis) - value(code, axis));
  }
  Wide nearest_code(double value, unsigned axis) const {
    if (curved_[axis]) return static_cast<Wide>(curved_[axis]->nearest_code(type_, value * unit_));
    const double code = std::floor(value * inverse_step_[axis] + 0.5);
    constexpr double most = sizeof(Code) == 4 ? 2147483647.0 : 9.2e18;
    // The comparisons also send NaN to an end: a conversion of what does not fit would be undefined.
    return code > -most ? code < most ? static_cast<Wide>(code) : static_cast<Wide>(most)
                        : static_cast<Wide>(-most);
  }

 private:
  double curved_value(Wide code, unsigned axis) const {
    // Squares of differences stay finite in doubles.
    constexpr double farthest = 1e30;
    const double value = curved_[axis]->value_of(type_, static_cast<int64_t>(code)) / unit_;
    return value < farthest ? value > -farthest ? value : -farthest : farthest;
  }

  Scalar type_;
  double unit_;
  std::span<Code> codes_;
  std::array<const NumberMap*, 3> curved_;
  std::array<Wide, 3> low_end_;
  std::array<Wide, 3> high_end_;
  std::array<double, 3> step_;
  std::array<double, 3> inverse_step_;
};

}  // namespace maille
