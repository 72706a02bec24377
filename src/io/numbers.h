#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

namespace maille {

/// A number as written in a text file.
struct Number {
  double value = 0;
  float single = 0;
  /// `single` says all the text does: the text is what a float prints as, rounded to the digits written.
  /// 0.1 and 93.425102 are, 0.10000000000000001 and 2594140.2 are not: those need a double.
  bool fits_single = true;
  bool integer = true;  ///< written without point and exponent
};

/// Parses the number at `p`: decimal, "nan", "inf", and MSVC's "1.#INF" forms. Returns the place behind it,
/// or nullptr when there is none or it is beyond the range of double. Correctly rounded for both types
/// (fast_float), whatever the locale.
const char* parse_number_slow(const char* p, const char* end, Number& number);

/// Whether this is a decimal beyond the range of double ("1e400"): for messages, as parse_number_slow()
/// refuses it.
bool is_beyond_double(const char* p, const char* end);

/// 10^n for |n| <= 22, where the power or its inverse division is exact in double.
inline constexpr double powers_of_ten[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                           1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                           1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/// The correctly rounded float of a decimal whose double is `value`; false when rounding twice could differ.
/// That is only so where the double lies exactly between two floats: 29 bits are cut off, and they are 1
/// followed by zeros.
inline bool round_to_single(double value, float& single) {
  uint64_t bits;
  static_assert(sizeof bits == sizeof value);
  __builtin_memcpy(&bits, &value, sizeof bits);
  single = static_cast<float>(value);
  return (bits & 0x1fffffff) != 0x10000000;  // exactly between two floats
}

/// The same as parse_number_slow(), with a short way for what most texts hold: at most 15 digits and no
/// exponent.
inline const char* parse_number(const char* const begin, const char* end, Number& number) {
  const char* p = begin;
  const bool negative = p != end && *p == '-';
  if (p != end && (*p == '-' || *p == '+')) ++p;
  uint64_t digits = 0;
  const char* const first = p;
  const auto digit_at = [&](const char* at) { return static_cast<unsigned>(*at) - unsigned{'0'}; };
  // Long digit strings wrap around here; they have more than 15 digits and are parsed again below.
  while (p != end && digit_at(p) < 10) digits = digits * 10 + digit_at(p++);
  auto count = p - first;
  int exponent = 0;
  number.integer = true;
  if (p != end && *p == '.') {
    const char* const fraction = ++p;
    while (p != end && digit_at(p) < 10) digits = digits * 10 + digit_at(p++);
    exponent = static_cast<int>(fraction - p);
    count += p - fraction;
    number.integer = false;
  }
  // 15 digits are below 2^53, so one multiplication or division by an exact power rounds correctly (Clinger).
  if (count == 0 || count > 15 || (p != end && (*p == 'e' || *p == 'E' || *p == '#'))) {
    return parse_number_slow(begin, end, number);
  }
  // -exponent is at most the number of digits, 15, so the index is inside the table.
  const double magnitude = static_cast<double>(digits) / powers_of_ten[-exponent];
  number.value = negative ? -magnitude : magnitude;
  if (!round_to_single(number.value, number.single)) return parse_number_slow(begin, end, number);
  // Six digits survive in any normal float; 10^-15 is one. A little more than one half: ties count as held.
  number.fits_single = digits < 1000000 || std::fabs(number.value - static_cast<double>(number.single)) <=
                                               0.5000001 / powers_of_ten[-exponent];
  return p;
}

}  // namespace maille
