#pragma once

#include "base/bytes.h"

namespace maille {

/// The bits of a float as a number that rises with it: 0 for 0, -1 for -0. And back.
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

/// Half octaves of |value|, finite: twice the binary exponent and the bit below the top one, so about twice
/// the binary logarithm. Below all others for 0.
inline int half_octaves_of(double value) {
  return static_cast<int>(bits_as<uint64_t>(value) >> 51 & 0xfff) - 2 * 1023;
}

}  // namespace maille
