#pragma once

#include <cstdint>

#include "numbers/float_bits.h"
#include "numbers/scaled_digits.h"

namespace maille {

/// Floats that were written with a fixed number of decimals: near zero, where floats are finer, decimal
/// fractions are counted, from some power of two on the floats themselves. Of kind `ordered`, with minus the
/// number of decimals as exponent. Mode `stream` only.
class DecimalFloats {
 public:
  static constexpr int most_decimals = 9;

  DecimalFloats() = default;
  explicit DecimalFloats(int decimals) : decimals_(decimals), scale_(exact_powers_of_ten[decimals]) {
    // The first power of two from which on floats are about as far apart as decimal fractions.
    // From 2^k on floats are 2^(k - 23) apart, and decimal fractions 1 / scale: as far where edge * scale is
    // 2^23. The .9 takes a power of two that is nearly there.
    for (edge_ = 1.0 / 1024; edge_ * scale_ < 0.9 * 8388608; edge_ *= 2) {
    }
    first_code_ = static_cast<int64_t>(edge_ * scale_ + 0.5);
    first_bits_ = bits_as<uint32_t>(static_cast<float>(edge_));
  }
  explicit operator bool() const { return decimals_ != 0; }

  /// Nearest; of what is above all floats that of the largest, of NaN some code.
  int64_t code_of(double number) const {
    const double size = number < 0 ? -number : number;
    int64_t code = 0;
    if (size < edge_) {
      code = static_cast<int64_t>(size * scale_ + 0.5);
    } else {
      const double bounded = size < largest ? size : largest;
      code = first_code_ + (int64_t{bits_as<uint32_t>(static_cast<float>(bounded))} - first_bits_);
    }
    return number < 0 ? -code : code;
  }
  double number_of(int64_t code) const {
    const bool negative = code < 0;
    const uint64_t size = negative ? -static_cast<uint64_t>(code) : static_cast<uint64_t>(code);
    double number = largest;
    if (size < static_cast<uint64_t>(first_code_)) {
      number = static_cast<double>(size) / scale_;
    } else if (size - static_cast<uint64_t>(first_code_) < 0x7f800000u - first_bits_) {
      const auto bits = first_bits_ + static_cast<uint32_t>(size - static_cast<uint64_t>(first_code_));
      number = static_cast<double>(bits_as<float>(bits));
    }
    return negative ? -number : number;
  }
  /// Half octaves of the distance of neighbours there.
  int unit_at(double place) const {
    const double size = place < 0 ? -place : place;
    // 6.644 half octaves are a factor of ten.
    if (!(size >= edge_)) return -decimals_ * 6644 / 1000;
    const int exponent = static_cast<int>(bits_as<uint64_t>(size) >> 52) - 1023;
    return 2 * ((exponent < 127 ? exponent : 127) - 23);
  }
  /// From there on they are floats.
  double edge() const { return edge_; }

 private:
  static constexpr double largest = 3.4028234663852886e38;
  int decimals_ = 0;
  double scale_ = 1;
  double edge_ = 0;
  int64_t first_code_ = 0;
  uint32_t first_bits_ = 0;
};

}  // namespace maille
