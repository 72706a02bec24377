#pragma once

#include <cstdint>

#include "base/bytes.h"

namespace maille {

/// Numbers with at most `digits` significant digits of a base, 2 or 10, and none behind the digit worth
/// base^exponent: floats are such numbers, and so is what printf("%.6g") leaves of them. Codes count them
/// from zero; negative ones, from negative zero on, are -1, -2 and so on.
struct ScaledDigits {
  uint32_t base = 2;
  uint32_t digits = 24;
  int32_t exponent = -149;

  /// The largest numbers of digits whose codes fit 32 and 64 bits: all bits of a float and a double, and
  /// decimals that the type tells apart everywhere, and one more.
  static constexpr uint32_t most_digits(uint32_t base, bool wide) {
    return base == 2 ? (wide ? 53 : 24) : (wide ? 16 : 7);
  }
  static constexpr int32_t least_exponent(uint32_t base) { return base == 2 ? -1074 : -340; }
  static constexpr int32_t most_exponent(uint32_t base) { return base == 2 ? 971 : 300; }

  /// The double next to the number of a code, as far as it is one of the numbers 10^q with |q| <= 22 times
  /// an integer below 2^53; others are rounded several times. Any code is fine.
  double number_of(int64_t code) const {
    if (base == 2) {
      const int64_t sign = code >> 63;
      const uint64_t shifted = static_cast<uint64_t>(code ^ sign) + static_cast<uint64_t>(first_bits());
      // From p = b^(d-1) on, numbers have all digits.
      if ((code ^ sign) >> (digits - 1) != 0 && is_normal(shifted >> (digits - 1))) {
        const uint64_t size = shifted << (53 - digits);
        return bits_as<double>(size | (static_cast<uint64_t>(sign) & uint64_t{1} << 63));
      }
    }
    return any_number_of(code);
  }
  /// The code of the number nearest to a double; for those that round to zero, that of their sign if they are
  /// zero, else that of positive zero. NaN is like zero.
  int64_t code_of(double number) const {
    if (base == 2) {
      const auto bits = bits_as<uint64_t>(number);
      const uint64_t size = bits & ~(uint64_t{1} << 63);
      const uint64_t field = size >> 52;
      if (is_normal(field) && static_cast<int64_t>(field) >= int64_t{1022} + digits + exponent) {
        const uint64_t half = (uint64_t{1} << (53 - digits)) >> 1;
        const int64_t place = static_cast<int64_t>((size + half) >> (53 - digits)) - first_bits();
        return place ^ -static_cast<int64_t>(bits >> 63);
      }
    }
    return any_code_of(number);
  }
  /// Place of the last digit that numbers of this size have: they are multiples of base^last_place.
  int32_t last_place(double number) const;

 private:
  /// Base 2: the bits of a number with all digits, as far as they are digits, are its code plus this. For the
  /// first such number, 2^(d-1+e), has the exponent field 1022 + d + e, shifted to the left by d - 1, and the
  /// code 2^(d-1); from there on both count the same numbers.
  int64_t first_bits() const { return (int64_t{1021} + digits + exponent) * (int64_t{1} << (digits - 1)); }
  static bool is_normal(uint64_t exponent_field) { return exponent_field >= 1 && exponent_field <= 2046; }
  /// The same of all numbers and codes.
  double any_number_of(int64_t code) const;
  int64_t any_code_of(double number) const;
  double scale(double number, int32_t power) const;
};

/// 10^power, for 0 to 22: what doubles hold exactly.
extern const double exact_powers_of_ten[23];

}  // namespace maille
