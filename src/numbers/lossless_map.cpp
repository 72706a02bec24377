#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/bytes.h"
#include "numbers/number_map.h"
#include "numbers/scaled_digits.h"

namespace maille {
namespace {

using Kind = NumberMap::Kind;

// Codes of floats in steps stay below this, so that they are exact as doubles and fit their integer.
template <class Number>
constexpr double largest_code = sizeof(Number) == 4 ? 2147483647.0 : 4503599627370496.0;
// How many numbers tell how many digits the others have. The sample only says where the search begins:
// another number that needs more digits raises them.
constexpr size_t sample_size = 512;
// Maps are compared by the logarithms of their steps, in 1/1024 octaves; log2(10) is 3.3219, or 3402 of
// these.
constexpr int64_t octave = 1024;
constexpr int64_t octaves_of_ten = 3402;
// Codes in steps are predicted faster and more exactly, so curved maps must save an eighth of a bit for each
// number. Chosen, not swept: a higher price wastes bits of numbers that were printed with significant digits,
// and with a lower one more arrays are predicted by way of value_of() and nearest_code().
constexpr int64_t price_of_curves = octave / 8;

/// The numbers of one component.
template <class Number>
struct Column {
  static constexpr Scalar type = sizeof(Number) == 4 ? Scalar::f32 : Scalar::f64;
  static constexpr bool wide = sizeof(Number) == 8;
  std::span<const Number> numbers;
  uint32_t component;
  uint32_t components;

  size_t size() const { return numbers.size() / components; }
  Number operator[](size_t i) const { return numbers[i * components + component]; }
};

/// What all numbers of a column have in common.
struct Digits {
  bool finite = true;
  int32_t lowest_bit = std::numeric_limits<int32_t>::max();  ///< all are multiples of 2^this
  int32_t bits = 1;                                          ///< most significant bits
  int32_t highest_bit = std::numeric_limits<int32_t>::min();
};

template <class Number>
Digits find_digits(const Column<Number>& column) {
  Digits digits;
  for (size_t i = 0; i < column.size(); ++i) {
    const double number = column[i];
    digits.finite = digits.finite && std::isfinite(number);
    if (number == 0 || !std::isfinite(number)) continue;
    int exponent;
    const double fraction = std::frexp(std::fabs(number), &exponent);
    const auto mantissa = static_cast<uint64_t>(std::ldexp(fraction, 53));
    const int zeros = __builtin_ctzll(mantissa);
    digits.lowest_bit = std::min(digits.lowest_bit, exponent - 53 + zeros);
    digits.bits = std::max(digits.bits, 53 - zeros);
    digits.highest_bit = std::max(digits.highest_bit, exponent);
  }
  // All numbers are zero.
  if (digits.lowest_bit > digits.highest_bit) digits.lowest_bit = digits.highest_bit = 0;
  return digits;
}

/// Does every number come back, bit for bit?
template <class Number>
bool fits(const Column<Number>& column, const NumberMap& map) {
  const bool steps = map.kind == Kind::decimal || map.kind == Kind::binary;
  const double unit = map.kind == Kind::decimal ? exact_powers_of_ten[map.exponent]
                      : steps                   ? std::ldexp(1.0, -map.exponent)
                                                : 1;
  for (size_t i = 0; i < column.size(); ++i) {
    const Number number = column[i];
    if (steps && !(std::fabs(number * unit) < largest_code<Number>)) return false;
    const int64_t code = map.code_of(column.type, reinterpret_cast<const std::byte*>(&number));
    Number back;
    map.store_number(column.type, code, reinterpret_cast<std::byte*>(&back));
    if (std::memcmp(&back, &number, sizeof back) != 0) return false;
  }
  return true;
}

/// The least number of decimal digits with which a number comes back; more than any map has if none. Halving
/// is right as a number that comes back with d digits does so with d + 1.
template <class Number>
uint32_t decimal_digits_of(Number number) {
  constexpr uint32_t most = ScaledDigits::most_digits(10, sizeof(Number) == 8);
  uint32_t low = 1;
  uint32_t high = most + 1;
  while (low < high) {
    const uint32_t middle = (low + high) / 2;
    const ScaledDigits digits{10, middle, ScaledDigits::least_exponent(10)};
    if (static_cast<Number>(digits.number_of(digits.code_of(number))) == number) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

/// Where the last decimal digit of a number stands that has at most so many.
template <class Number>
std::optional<int32_t> last_decimal(Number number, uint32_t digits) {
  const double size = std::fabs(number);
  const ScaledDigits all{10, digits, ScaledDigits::least_exponent(10)};
  const int32_t place = all.last_place(size);
  NumberMap map{.kind = Kind::decimal_digits, .exponent = place};
  map.digits = digits;
  const auto type = sizeof(Number) == 4 ? Scalar::f32 : Scalar::f64;
  int64_t code = map.code_of(type, reinterpret_cast<const std::byte*>(&number));
  Number back;
  map.store_number(type, code, reinterpret_cast<std::byte*>(&back));
  if (back != number) return {};
  if (code < 0) code = -1 - code;
  int32_t zeros = 0;
  for (; code != 0 && code % 10 == 0; code /= 10) ++zeros;
  return place + zeros;
}

/// The map with the fewest significant decimal digits.
template <class Number>
std::optional<NumberMap> find_decimal_digits(const Column<Number>& column) {
  constexpr uint32_t most = ScaledDigits::most_digits(10, sizeof(Number) == 8);
  uint32_t digits = 1;
  const size_t stride = column.size() / sample_size + 1;
  for (size_t i = 0; i < column.size() && digits <= most; i += stride) {
    if (column[i] != 0) digits = std::max(digits, decimal_digits_of(column[i]));
  }
  int32_t last = ScaledDigits::most_exponent(10);
  for (size_t i = 0; i < column.size() && digits <= most; ++i) {
    if (column[i] == 0) continue;
    // The type does not tell all decimals of most digits apart: with fewer, it is the one that was meant.
    std::optional<int32_t> place;
    if (digits == most) place = last_decimal(column[i], digits - 1);
    if (!place) place = last_decimal(column[i], digits);
    if (!place) {
      digits = std::max(digits + 1, decimal_digits_of(column[i]));
      if (digits > most) break;
      place = last_decimal(column[i], digits);
    }
    if (place) last = std::min(last, *place);
  }
  NumberMap map{.kind = Kind::decimal_digits, .exponent = last};
  map.digits = digits;
  if (digits > most || last < ScaledDigits::least_exponent(10) || !fits(column, map)) return {};
  return map;
}

/// Sum of the logarithms of a map's steps where the numbers are: the larger, the fewer bits. For residuals
/// much larger than a step take about log2(residual / step) bits each, and the residual among numbers is the
/// same for all maps. Steps that are far finer than the numbers' range count as not so fine, since numbers
/// near zero are mostly just that.
template <class Number>
int64_t coarseness(const Column<Number>& column, const NumberMap& map, const Digits& digits) {
  const int64_t finest = (digits.highest_bit - (column.wide ? 64 : 32)) * octave;
  const bool decimal = map.kind == Kind::decimal || map.kind == Kind::decimal_digits;
  const auto step_at = [&](double number) -> int64_t {
    switch (map.kind) {
      case Kind::decimal:
        return -map.exponent * octaves_of_ten;
      case Kind::binary:
        return map.exponent * octave;
      case Kind::ordered:
        return ScaledDigits{2, column.wide ? 53u : 24u, column.wide ? -1074 : -149}.last_place(number) *
               octave;
      default:
        return ScaledDigits{decimal ? 10u : 2u, map.digits, map.exponent}.last_place(number) *
               (decimal ? octaves_of_ten : octave);
    }
  };
  int64_t sum = 0;
  for (size_t i = 0; i < column.size(); ++i) {
    const double number = column[i];
    if (number == 0 || !std::isfinite(number)) continue;
    sum += std::max(finest, step_at(number)) - (map.is_curved() ? price_of_curves : 0);
  }
  return sum;
}

template <class Number>
NumberMap choose_float_map(const Column<Number>& column);

/// Of doubles that are decimals, the map of the floats that they may have been printed from: a program that
/// keeps floats and prints them by "%.6f" leaves 24 bits in what reads as a double of 50. Numbers above 10^30
/// are left alone, as floats end at 10^38.
std::optional<NumberMap> find_printed_floats(const Column<double>& column, int32_t decimals) {
  constexpr int32_t most_decimals = 9;  // more do not make floats any coarser
  if (decimals > most_decimals) return {};
  std::vector<float> floats;
  floats.reserve(column.size());
  for (size_t i = 0; i < column.size(); ++i) {
    if (!(std::fabs(column[i]) < 1e30)) return {};
    floats.push_back(static_cast<float>(column[i]));
  }
  NumberMap map = choose_float_map(Column<float>{floats, 0, 1});
  if (map.kind != Kind::binary_digits && map.kind != Kind::decimal_digits) return {};
  map.decimals = decimals;
  if (!fits(column, map)) return {};
  return map;
}

template <class Number>
NumberMap choose_float_map(const Column<Number>& column) {
  const Digits digits = find_digits(column);
  NumberMap best{.kind = Kind::ordered};
  if (!digits.finite) return best;
  int64_t most = coarseness(column, best, digits);
  const auto consider = [&](const NumberMap& map) {
    const int64_t coarse = coarseness(column, map, digits);
    // Of equal maps the last one wins: decimals and binary steps are tried after digits, and are faster.
    if (coarse < most) return;
    best = map;
    most = coarse;
  };
  NumberMap floats{.kind = Kind::binary_digits,
                   .exponent = std::min(digits.lowest_bit, ScaledDigits::most_exponent(2))};
  floats.digits = static_cast<uint32_t>(digits.bits);
  if (fits(column, floats)) consider(floats);
  const NumberMap binary{.kind = Kind::binary, .exponent = digits.lowest_bit};
  if (binary.exponent > -1000 && fits(column, binary)) consider(binary);
  const auto decimals = find_decimal_digits(column);
  if (decimals) consider(*decimals);
  constexpr int32_t most_decimals = 15;
  // Numbers with decimal digits end at the digit worth 10^exponent, so only that many places can fit. The
  // format has at most fifteen places.
  const int32_t first = decimals ? std::clamp(-decimals->exponent, 0, most_decimals) : 0;
  for (int32_t places = first; places <= (decimals ? first : most_decimals); ++places) {
    const NumberMap decimal{.kind = Kind::decimal, .exponent = places};
    if (!fits(column, decimal)) continue;
    consider(decimal);
    if constexpr (sizeof(Number) == 8) {
      if (const auto printed = find_printed_floats(column, places)) consider(*printed);
    }
    break;
  }
  return best;
}

}  // namespace

NumberMap choose_lossless_map(const Array& array, uint32_t component) {
  if (array.type == Scalar::f32)
    return choose_float_map(Column<float>{array.values<float>(), component, array.components});
  if (array.type == Scalar::f64)
    return choose_float_map(Column<double>{array.values<double>(), component, array.components});
  return {};
}

}  // namespace maille
