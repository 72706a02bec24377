#include "numbers/scaled_digits.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/bytes.h"

namespace maille {

const double exact_powers_of_ten[23] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                        1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                        1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

namespace {

constexpr double largest_number = std::numeric_limits<double>::max();

int64_t whole_power(uint32_t base, uint32_t exponent) {
  static constexpr int64_t of_ten[17] = {1,
                                         10,
                                         100,
                                         1000,
                                         10000,
                                         100000,
                                         1000000,
                                         10000000,
                                         100000000,
                                         1000000000,
                                         10000000000,
                                         100000000000,
                                         1000000000000,
                                         10000000000000,
                                         100000000000000,
                                         1000000000000000,
                                         10000000000000000};
  return base == 2 ? int64_t{1} << exponent : of_ten[exponent];
}

/// The nearest integer, halves upwards; x + 0.5 would be rounded itself from 2^52 on.
double nearest_integer(double x) {
  if (x >= 0 && x < 4503599627370496.0) {
    const auto whole = static_cast<double>(static_cast<int64_t>(x));  // without a call of floor()
    return x - whole < 0.5 ? whole : whole + 1;
  }
  const double below = std::floor(x);
  return x - below < 0.5 ? below : below + 1;
}

/// Nearly 10^-power; only for -22 to 22.
double about_power(int32_t power) {
  static constexpr double below[23] = {1e0,   1e-1,  1e-2,  1e-3,  1e-4,  1e-5,  1e-6,  1e-7,
                                       1e-8,  1e-9,  1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15,
                                       1e-16, 1e-17, 1e-18, 1e-19, 1e-20, 1e-21, 1e-22};
  return power > 0 ? below[power] : exact_powers_of_ten[-power];
}

}  // namespace

/// number * base^power. `power` is within some thousands, so the loops take at most about a hundred rounds,
/// even of damaged maps and codes.
double ScaledDigits::scale(double number, int32_t power) const {
  // Powers of two that are doubles themselves save a call of ldexp(), which rounds the same.
  if (base == 2 && power >= -1022 && power <= 1023)
    return number * bits_as<double>(static_cast<uint64_t>(power + 1023) << 52);
  if (base == 2) return std::ldexp(number, power);
  for (; power < -22; power += 22) number /= exact_powers_of_ten[22];
  for (; power > 22; power -= 22) number *= exact_powers_of_ten[22];
  return power < 0 ? number / exact_powers_of_ten[-power] : number * exact_powers_of_ten[power];
}

double ScaledDigits::any_number_of(int64_t code) const {
  const bool negative = code < 0;
  const int64_t place = negative ? -1 - code : code;
  const int64_t first = whole_power(base, digits);  // from here on numbers have all digits
  const int64_t decade = first - first / base;
  int64_t mantissa = place;
  int64_t power = exponent;
  if (place >= first) {
    const int64_t beyond = place - first;
    const int64_t decades = base == 2 ? beyond >> (digits - 1) : beyond / decade;
    mantissa = first / base + (beyond - decades * decade);
    // A damaged code may be any number of decades up: the number is infinite from 2000 on anyway, and is
    // clamped to its type later.
    power = std::min<int64_t>(power + 1 + decades, 2000);
  }
  const double number = scale(static_cast<double>(mantissa), static_cast<int32_t>(power));
  return negative ? -number : number;
}

int32_t ScaledDigits::last_place(double number) const {
  const double size = std::fabs(number);
  int binary_exponent = static_cast<int>(bits_as<uint64_t>(size) >> 52) - 1022;
  if (binary_exponent <= -1022) (void)std::frexp(size, &binary_exponent);  // size < 2^binary_exponent
  const int32_t least = exponent;
  if (size == 0) return least;
  if (base == 2) return std::max(least, binary_exponent - static_cast<int32_t>(digits));
  // The decimal exponent from the binary one, which is off by one at most.
  int32_t power = std::max(least, (binary_exponent - 1) * 1233 / 4096 - static_cast<int32_t>(digits) - 1);
  const auto limit = static_cast<double>(whole_power(base, digits));
  const auto has_room = [&](int32_t at) {
    if (at >= -22 && at <= 22) {
      // Two roundings, less than 1e-15 of it: only near the limit it takes a division. Without the others
      // ogre (six digits, without loss) decodes in three quarters of the time.
      const double about = size * about_power(at);
      if (about < (limit - 0.5) * (1 - 1e-14)) return true;
      if (about > (limit - 0.5) * (1 + 1e-14)) return false;
    }
    return nearest_integer(scale(size, -at)) < limit;
  };
  while (power < most_exponent(base) && !has_room(power)) ++power;
  return power;
}

int64_t ScaledDigits::any_code_of(double number) const {
  double size = std::fabs(number);
  if (!(size == size)) return 0;
  size = std::min(size, largest_number);
  const int32_t power = last_place(size);
  const auto mantissa = static_cast<int64_t>(nearest_integer(scale(size, -power)));
  const int64_t first = whole_power(base, digits);
  const int64_t decade = first - first / base;
  const int64_t place = power == exponent
                            ? mantissa
                            : first + (int64_t{power} - exponent - 1) * decade + mantissa - first / base;
  if (place == 0 && size > 0) return 0;
  return std::signbit(number) ? -1 - place : place;
}

}  // namespace maille
