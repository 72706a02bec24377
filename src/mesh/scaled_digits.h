#pragma once

#include <cstdint>

namespace maille {

/// Numbers with at most `digits` significant digits of a base, 2 or 10, and none behind the digit worth
/// base^exponent: floats are such numbers, and so is what printf("%.6g") leaves of them. Codes count them
/// from zero; negative ones, from negative zero on, are -1, -2 and so on.
struct ScaledDigits {
  uint32_t base = 2;
  uint32_t digits = 24;
  int32_t exponent = -149;

  /// The largest numbers of digits whose codes fit 32 and 64 bits.
  static constexpr uint32_t most_digits(uint32_t base, bool wide) {
    return base == 2 ? (wide ? 53 : 24) : (wide ? 16 : 7);
  }
  static constexpr int32_t least_exponent(uint32_t base) { return base == 2 ? -1074 : -340; }
  static constexpr int32_t most_exponent(uint32_t base) { return base == 2 ? 971 : 300; }

  /// The double next to the number of a code, as far as it is one of the numbers 10^q with |q| <= 22 times
  /// an integer below 2^53; others are rounded several times. Any code is fine.
  double number_of(int64_t code) const;
  /// The code of the number nearest to a double; for those that round to zero, that of their sign if they are
  /// zero, else that of positive zero. NaN is like zero.
  int64_t code_of(double number) const;
  /// Place of the last digit that numbers of this size have: they are multiples of base^last_place.
  int32_t last_place(double number) const;

 private:
  double scale(double number, int32_t power) const;
  double first_with_all_digits() const;
};

/// 10^power, for 0 to 22: what doubles hold exactly.
extern const double exact_powers_of_ten[23];

}  // namespace maille
