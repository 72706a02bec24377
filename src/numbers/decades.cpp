#include "numbers/decades.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maille {

Decades::Decades(const ScaledDigits& digits) : digits_(digits) {
  // 10^15 is the largest power whose half steps a double holds; powers from -22 to 0 scale by one product.
  if (digits.base != 10 || digits.digits > 15 || digits.exponent < -22 || digits.exponent >= 0) return;
  const auto limit = static_cast<int64_t>(exact_powers_of_ten[digits.digits]);
  const int64_t places = limit - limit / 10;  // of each decade but the first
  for (int32_t power = digits.exponent; power <= 0; ++power) {
    const int64_t decade = power - digits.exponent;
    const int64_t begin = decade == 0 ? 0 : limit + (decade - 1) * places;
    decades_.push_back({begin, decade == 0 ? 0 : begin - limit / 10, exact_powers_of_ten[-power]});
  }
  per_decade_ = 1 / static_cast<double>(places);
  add_binades();
}

/// Within one binade (doubles of one exponent) at most one decade begins, since ten is more than two. Its
/// first number is found by trial, starting from where it is in theory, so that the table agrees with
/// last_place() to the last bit. Ends when the last decade does.
void Decades::add_binades() {
  const auto field_of = [](double number) { return bits_as<uint64_t>(number) >> 52; };
  // Below, numbers round to the first codes or to none.
  first_binade_ = field_of(1 / decades_.front().scale);
  for (uint64_t field = first_binade_;; ++field) {
    const auto least = bits_as<double>(field << 52);
    const double above = 2 * least;
    const int32_t power = digits_.last_place(least), last = digits_.last_place(std::nextafter(above, 0));
    if (last > 0) return;  // the decade after the last one has no entry
    double next = std::numeric_limits<double>::infinity();
    if (last > power) {
      const auto scale = exact_powers_of_ten[-power];
      next = (exact_powers_of_ten[digits_.digits] - 0.5) / scale;
      while (digits_.last_place(next) > power) next = std::nextafter(next, 0);
      while (digits_.last_place(next) == power) next = std::nextafter(next, above);
    }
    binades_.push_back({next, static_cast<uint32_t>(power - digits_.exponent)});
  }
}

}  // namespace maille
