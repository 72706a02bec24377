#pragma once

#include <algorithm>
#include <limits>

#include "base/bytes.h"

namespace maille {

/// The bits of a float as a number that rises with it: 0 for 0, -1 for -0. And back. IEEE floats are sign and
/// magnitude, so that those of one sign are in order already; negative ones are turned round. Every pattern
/// has a code of its own, NaNs beyond the infinities.
inline int32_t ordered_bits(float number) {
  const auto bits = bits_as<int32_t>(number);
  return bits < 0 ? bits ^ 0x7fffffff : bits;
}
inline int64_t ordered_bits(double number) {
  const auto bits = bits_as<int64_t>(number);
  return bits < 0 ? bits ^ 0x7fffffffffffffff : bits;
}
inline float from_ordered(int32_t code) {
  return bits_as<float>(code < 0 ? code ^ 0x7fffffff : code);
}
inline double from_ordered(int64_t code) {
  return bits_as<double>(code < 0 ? code ^ 0x7fffffffffffffff : code);
}

/// A double as a float: the nearest finite one, or one of the same kind if it is infinite or NaN, with the
/// bits that fit. NaNs go by their bits, as conversions of NaN differ among processors.
inline float as_float(double number) {
  constexpr double largest = std::numeric_limits<float>::max();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (number == number) {
    const bool finite = number < infinity && number > -infinity;
    return static_cast<float>(finite ? std::clamp(number, -largest, largest) : number);
  }
  const auto bits = bits_as<uint64_t>(number);
  return bits_as<float>(static_cast<uint32_t>(bits >> 63 << 31 | 0x7f800000 | (bits >> 29 & 0x7fffff)));
}
/// And back, with the same bits on all machines.
inline double as_double(float number) {
  if (number == number) return number;
  const uint64_t bits = bits_as<uint32_t>(number);
  return bits_as<double>(bits >> 31 << 63 | uint64_t{0x7ff} << 52 | (bits & 0x7fffff) << 29);
}

/// Half octaves of |value|, finite: twice the binary exponent and the bit below the top one, so about twice
/// the binary logarithm. Below all others for 0.
inline int half_octaves_of(double value) {
  return static_cast<int>(bits_as<uint64_t>(value) >> 51 & 0xfff) - 2 * 1023;
}

}  // namespace maille
