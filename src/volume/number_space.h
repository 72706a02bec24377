#pragma once

#include "entropy/residual_model.h"
#include "mesh/number_map.h"

namespace maille {

/// Half octaves of |value|: twice the binary exponent and the bit below the top one. Below all others for 0.
inline int half_octaves_of(double value) {
  const auto bits = bits_as<uint64_t>(value);
  return static_cast<int>(bits >> 51 & 0xfff) - 2046;
}

/// Where the numbers of one component lie, for prediction: floats that keep their bits at their value, all others at
/// their code. Predictions are made in doubles there, residuals between codes.
class NumberSpace {
 public:
  NumberSpace(Scalar type, const NumberMap& map)
      : type_(type), map_(map), ordered_(map.kind == NumberMap::Kind::ordered) {}

  bool exact() const { return ordered_ || map_.kind == NumberMap::Kind::integer; }
  int64_t code_of(const std::byte* number) const {
    if (ordered_ && type_ == Scalar::f32) return ordered_bits(load<float>(number));
    return map_.code_of(type_, number);
  }
  void store_number(int64_t code, std::byte* out) const {
    if (ordered_ && type_ == Scalar::f32) return store(out, from_ordered(static_cast<int32_t>(code)));
    map_.store_number(type_, code, out);
  }
  double place_of(int64_t code) const {
    if (!ordered_) return static_cast<double>(code);
    if (type_ != Scalar::f32) return NumberMap::ordered_value(type_, code);
    const float value = from_ordered(static_cast<int32_t>(code));
    return value == value ? static_cast<double>(value) : 0;
  }
  int64_t code_near(double place) const {
    if (ordered_) {
      constexpr double largest = 3.4028234663852886e38;
      if (type_ != Scalar::f32) return NumberMap::nearest_ordered(type_, place);
      if (!(place == place)) return 0;
      return ordered_bits(static_cast<float>(place < -largest ? -largest : place > largest ? largest : place));
    }
    constexpr double most = 9.0e18;
    if (!(place == place)) return 0;
    if (place > most || place < -most) return place < 0 ? -int64_t{9'000'000'000'000'000'000} : int64_t{9'000'000'000'000'000'000};
    const auto whole = static_cast<int64_t>(place);
    const double rest = place - static_cast<double>(whole);
    return whole + (rest >= 0.5) - (rest < -0.5);
  }
  /// Half octaves of the distance between neighbouring codes there.
  int unit_at(double place) const {
    if (!ordered_) return 0;
    const int bits = type_ == Scalar::f32 ? 23 : 52;
    const int least = type_ == Scalar::f32 ? -126 : -1022;
    const int exponent = static_cast<int>(bits_as<uint64_t>(place) >> 52 & 0x7ff) - 1023;
    return 2 * ((exponent < least ? least : exponent) - bits);
  }

 private:
  static int32_t ordered_bits(float number) {
    const auto bits = bits_as<int32_t>(number);
    return bits < 0 ? bits ^ 0x7fffffff : bits;
  }
  static float from_ordered(int32_t code) { return bits_as<float>(code < 0 ? code ^ 0x7fffffff : code); }

  Scalar type_;
  NumberMap map_;
  bool ordered_;
};

}  // namespace maille
