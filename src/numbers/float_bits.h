#pragma once

#include <algorithm>
#include <limits>

#include "base/bytes.h"

namespace maille {

// Numbers that come back bit for bit are handled as bits. On i386 a function returns floats in a register of
// the 387, which makes signalling NaNs quiet.

/// The bits of a float as a number that rises with it: 0 for 0, -1 for -0. It is its own inverse. IEEE floats
/// are sign and magnitude, so that those of one sign are in order already; negative ones are turned round.
/// Every pattern has a code of its own, NaNs beyond the infinities.
inline int32_t ordered(int32_t bits) {
  return bits < 0 ? bits ^ 0x7fffffff : bits;
}
inline int64_t ordered(int64_t bits) {
  return bits < 0 ? bits ^ 0x7fffffffffffffff : bits;
}

/// The same for numbers that were computed.
inline int32_t ordered_bits(float number) {
  return ordered(bits_as<int32_t>(number));
}
inline int64_t ordered_bits(double number) {
  return ordered(bits_as<int64_t>(number));
}

/// The bits of a double as a float: of the nearest finite one, or one of the same kind if it is infinite or
/// NaN, with the bits that fit. NaNs go by their bits, as conversions of NaN differ among processors.
inline uint32_t narrowed_bits(double number) {
  constexpr double largest = std::numeric_limits<float>::max();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (number == number) {
    const bool finite = number < infinity && number > -infinity;
    return bits_as<uint32_t>(static_cast<float>(finite ? std::clamp(number, -largest, largest) : number));
  }
  const auto bits = bits_as<uint64_t>(number);
  return static_cast<uint32_t>(bits >> 63 << 31 | 0x7f800000 | (bits >> 29 & 0x7fffff));
}
/// And back: the bits of a double from those of a float, the same on all machines.
inline uint64_t widened_bits(uint32_t float_bits) {
  const auto number = bits_as<float>(float_bits);
  if (number == number) return bits_as<uint64_t>(static_cast<double>(number));
  const uint64_t bits = float_bits;
  return bits >> 31 << 63 | uint64_t{0x7ff} << 52 | (bits & 0x7fffff) << 29;
}

/// Half octaves of |value|, finite: twice the binary exponent and the bit below the top one, so about twice
/// the binary logarithm. Below all others for 0.
inline int half_octaves_of(double value) {
  return static_cast<int>(bits_as<uint64_t>(value) >> 51 & 0xfff) - 2 * 1023;
}

}  // namespace maille
