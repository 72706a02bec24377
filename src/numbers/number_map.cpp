#include "numbers/number_map.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "numbers/fixed_log.h"
#include "numbers/float_bits.h"
#include "numbers/lattice_code.h"
#include "numbers/scaled_digits.h"

namespace maille {
namespace {

/// 2^exponent, for -1074 to 1023.
double power_of_two(int32_t exponent) {
  return std::ldexp(1.0, exponent);
}

/// Doubles are rounded to the type of number; out of range goes to the nearest end, NaN to 0 for integers.
/// Casting what is out of range is undefined in C++, and codes of damaged files get here, so all is clamped
/// first; clamp() lets NaN pass, which floats keep.
template <class Number>
Number rounded_to(double value) {
  if constexpr (std::is_floating_point_v<Number>) {
    constexpr double largest = std::numeric_limits<Number>::max();
    return static_cast<Number>(std::clamp(value, -largest, largest));
  } else {
    if (!(value == value)) return 0;
    const double whole = std::floor(value + 0.5);
    // The upper ends of the 64-bit types are not doubles; the next double below them is.
    constexpr auto low = static_cast<double>(std::numeric_limits<Number>::min());
    constexpr auto high = static_cast<double>(std::numeric_limits<Number>::max());
    if (whole <= low) return std::numeric_limits<Number>::min();
    if (whole >= high) return std::numeric_limits<Number>::max();
    return static_cast<Number>(whole);
  }
}

template <class Number>
void store_as(double value, std::byte* out) {
  store(out, rounded_to<Number>(value));
}

void store_rounded(Scalar type, double value, std::byte* out) {
  switch (type) {
    case Scalar::i8:
      return store_as<int8_t>(value, out);
    case Scalar::u8:
      return store_as<uint8_t>(value, out);
    case Scalar::i16:
      return store_as<int16_t>(value, out);
    case Scalar::u16:
      return store_as<uint16_t>(value, out);
    case Scalar::i32:
      return store_as<int32_t>(value, out);
    case Scalar::u32:
      return store_as<uint32_t>(value, out);
    case Scalar::i64:
      return store_as<int64_t>(value, out);
    case Scalar::u64:
      return store_as<uint64_t>(value, out);
    case Scalar::f32:
      return store_as<float>(value, out);
    case Scalar::f64:
      return store_as<double>(value, out);
  }
}

int64_t integer_bits(Scalar type, const std::byte* number) {
  switch (size_of(type)) {
    case 1:
      return type == Scalar::u8 ? load<uint8_t>(number) : load<int8_t>(number);
    case 2:
      return type == Scalar::u16 ? load<uint16_t>(number) : load<int16_t>(number);
    case 4:
      return load<int32_t>(number);
    default:
      return load<int64_t>(number);
  }
}

void store_integer(Scalar type, int64_t code, std::byte* out) {
  switch (size_of(type)) {
    case 1:
      return store(out, static_cast<int8_t>(code));
    case 2:
      return store(out, static_cast<int16_t>(code));
    case 4:
      return store(out, static_cast<int32_t>(code));
    default:
      return store(out, code);
  }
}

}  // namespace

double sixteenth_of_octave(int32_t index) {
  // 2^(k / 16), each the nearest double.
  static constexpr double steps[16] = {1.0,
                                       1.0442737824274138,
                                       1.0905077326652577,
                                       1.1387886347566916,
                                       1.189207115002721,
                                       1.241857812073484,
                                       1.2968395546510096,
                                       1.3542555469368927,
                                       1.4142135623730951,
                                       1.4768261459394993,
                                       1.5422108254079407,
                                       1.6104903319492543,
                                       1.681792830507429,
                                       1.7562521603732995,
                                       1.8340080864093424,
                                       1.9152065613971474};
  // The quotient is rounded down, for negative numbers, too.
  const int32_t octave = index >= 0 ? index / 16 : -((15 - index) / 16);
  return steps[index - 16 * octave] * power_of_two(octave);
}

double number_as_double(Scalar type, const std::byte* number) {
  switch (type) {
    case Scalar::u32:
      return load<uint32_t>(number);
    case Scalar::u64:
      return static_cast<double>(load<uint64_t>(number));
    case Scalar::f32:
      return load<float>(number);
    case Scalar::f64:
      return load<double>(number);
    default:
      return static_cast<double>(integer_bits(type, number));
  }
}

namespace {

ScaledDigits digits_of(const NumberMap& map) {
  return {map.kind == NumberMap::Kind::binary_digits ? 2u : 10u, map.digits, map.exponent};
}

/// The map of the floats that a factor belongs to.
NumberMap without_factor(const NumberMap& map) {
  NumberMap plain{.kind = map.kind, .exponent = map.exponent};
  plain.digits = map.digits;
  return plain;
}
double value_with_factor(const NumberMap& map, int64_t code) {
  float number;
  without_factor(map).store_number(Scalar::f32, code, reinterpret_cast<std::byte*>(&number));
  return static_cast<double>(number) * map.factor;
}
int64_t code_with_factor(const NumberMap& map, double number) {
  const auto floated = rounded_to<float>(number / map.factor);
  return without_factor(map).code_of(Scalar::f32, reinterpret_cast<const std::byte*>(&floated));
}

/// Codes count from the least number on, on both sides of zero. FixedLog takes logarithms up to 2000; beyond
/// 1024 and below -1074 numbers are infinite or zero anyway.
double number_of_logarithm(const NumberMap& map, double code) {
  if (code == 0) return 0;
  const double log = (map.origin + std::fabs(code)) * map.step;
  const double size = FixedLog::power(log < 2000 ? log > -2000 ? log : -2000 : 2000);
  return code < 0 ? -size : size;
}
/// 0 for what has no code: smaller numbers than the map was made for, and too large ones. From 2^52 on
/// doubles cannot tell codes apart.
int64_t code_of_logarithm(const NumberMap& map, double number) {
  if (number == 0 || !std::isfinite(number)) return 0;
  const double code = std::floor(FixedLog::of(std::fabs(number)) / map.step + 0.5) - map.origin;
  if (!(code >= 1 && code < 4503599627370496.0)) return 0;
  return number < 0 ? -static_cast<int64_t>(code) : static_cast<int64_t>(code);
}

/// See NumberMap::decimals. Halves go to the even neighbour, as in "%f". Up to 9 decimals the product is
/// exact: a float has 24 bits, and 10^9 = 2^9 * 5^9 adds the 21 of 5^9, which is 45 of the 53 that a double
/// holds.
double printed_float(double number, int32_t decimals) {
  const double unit = exact_powers_of_ten[decimals];
  const double units = static_cast<double>(rounded_to<float>(number)) * unit;
  const double below = std::floor(units);
  const double half = below / 2;
  const bool up = units - below > 0.5 || (units - below == 0.5 && half != std::floor(half));
  return (up ? below + 1 : below) / unit;
}

int64_t clamped_rank(int64_t code, size_t size) {
  return std::clamp<int64_t>(code, 0, static_cast<int64_t>(size) - 1);
}

/// As std::lower_bound(), without branches: no processor can guess which half is next. `left` becomes half of
/// what it was, rounded down, so the loop ends after the logarithm of the size.
const double* first_not_below(const std::vector<double>& table, double value) {
  const double* first = table.data();
  for (size_t left = table.size(); left > 0;) {
    const size_t half = (left + 1) / 2;
    first += half * static_cast<size_t>(first[half - 1] < value);
    left -= half;
  }
  return first;
}

/// The nearest number of a table, of the first one that is not below the value and the one before.
int64_t nearer_rank(const std::vector<double>& table, const double* above, double value) {
  const int64_t rank = above - table.data();
  if (rank == 0) return 0;
  if (rank == static_cast<int64_t>(table.size())) return rank - 1;
  return rank - (value - above[-1] < *above - value ? 1 : 0);
}

/// Of a number in the table; -0 comes before 0.
int64_t rank_of(const std::vector<double>& table, double number) {
  auto at = std::lower_bound(table.begin(), table.end(), number);
  if (number == 0 && at != table.end() && std::signbit(*at) && !std::signbit(number)) ++at;
  return clamped_rank(at - table.begin(), table.size());
}

}  // namespace

int64_t NumberMap::code_of(Scalar type, const std::byte* number) const {
  if (!table.empty()) return rank_of(table, number_as_double(type, number));
  if (factor != 0) return code_with_factor(*this, number_as_double(type, number));
  switch (kind) {
    case Kind::integer:
      return integer_bits(type, number);
    case Kind::ordered:
      return type == Scalar::f32 ? ordered(load<int32_t>(number)) : ordered(load<int64_t>(number));
    case Kind::decimal:
      return lattice_code(number_as_double(type, number) * exact_powers_of_ten[exponent], 0, 1);
    case Kind::binary:
      return lattice_code(number_as_double(type, number) * power_of_two(-exponent), 0, 1);
    case Kind::lattice:
      break;
    case Kind::logarithm:
      return reaches(type, number) ? code_of_logarithm(*this, number_as_double(type, number)) : 0;
    case Kind::binary_digits:
    case Kind::decimal_digits:
      if (decimals >= 0) return digits_of(*this).code_of(rounded_to<float>(number_as_double(type, number)));
      return digits_of(*this).code_of(number_as_double(type, number));
  }
  return reaches(type, number) ? lattice_code(number_as_double(type, number), origin, step) : 0;
}

bool NumberMap::reaches(Scalar type, const std::byte* number) const {
  // Of 64 bits only those that doubles tell apart.
  // 2^52 and 2^31 - 1.
  const double most = size_of(type) == 8 ? 4503599627370496.0 : 2147483647.0;
  const double value = number_as_double(type, number);
  if (kind != Kind::logarithm) return std::fabs((value - origin) / step) < most;
  const auto code = static_cast<double>(code_of_logarithm(*this, value));
  return value == 0 || (code != 0 && std::fabs(code) < most);
}

void NumberMap::store_number(Scalar type, int64_t code, std::byte* out) const {
  if (!table.empty() || factor != 0) return store_rounded(type, value_of(type, code), out);
  const auto real = static_cast<double>(code);
  switch (kind) {
    case Kind::integer:
      return store_integer(type, code, out);
    case Kind::ordered:
      if (type == Scalar::f32) return store(out, ordered(static_cast<int32_t>(code)));
      return store(out, ordered(code));
    case Kind::decimal:
      return store_rounded(type, real / exact_powers_of_ten[exponent], out);
    case Kind::binary:
      return store_rounded(type, real * power_of_two(exponent), out);
    case Kind::lattice:
      return store_rounded(type, origin + real * step, out);
    case Kind::logarithm:
      return store_rounded(type, number_of_logarithm(*this, real), out);
    case Kind::binary_digits:
    case Kind::decimal_digits:
      if (decimals >= 0)
        return store_rounded(type, printed_float(digits_of(*this).number_of(code), decimals), out);
      return store_rounded(type, digits_of(*this).number_of(code), out);
  }
}

namespace {

/// Every number is `number_of` its code, rounded to the type.
template <class Number, class NumberOf>
void store_column(const std::byte* codes, std::byte* out, size_t stride, size_t count, NumberOf number_of) {
  using Code = std::conditional_t<sizeof(Number) == 8, int64_t, int32_t>;
  for (size_t i = 0; i < count; ++i) {
    const auto code = static_cast<double>(load<Code>(codes + i * stride * sizeof(Code)));
    store(out + i * stride * sizeof(Number), rounded_to<Number>(number_of(code)));
  }
}

}  // namespace

void NumberMap::store_numbers(Scalar type, const std::byte* codes, std::byte* out, size_t stride,
                              size_t count) const {
  // What most files hold gets loops of its own: there store_number()'s choice of a kind would be made for
  // every number. They must give the same numbers as it does.
  const auto store_reals = [&](auto zero) {
    using Number = decltype(zero);
    if (kind == Kind::lattice) {
      store_column<Number>(codes, out, stride, count, [*this](double c) { return origin + c * step; });
    } else {
      const double unit = kind == Kind::decimal ? exact_powers_of_ten[exponent] : power_of_two(exponent);
      if (kind == Kind::decimal) {
        store_column<Number>(codes, out, stride, count, [unit](double c) { return c / unit; });
      } else {
        store_column<Number>(codes, out, stride, count, [unit](double c) { return c * unit; });
      }
    }
  };
  const bool real = kind != Kind::integer && kind != Kind::logarithm && !is_curved() && factor == 0;
  if (real && type == Scalar::f32) return store_reals(0.0f);
  if (real && type == Scalar::f64) return store_reals(0.0);
  if (kind == Kind::integer && size_of(type) == 4 && table.empty() && factor == 0) {
    for (size_t i = 0; i < count; ++i) store(out + i * stride * 4, load<uint32_t>(codes + i * stride * 4));
    return;
  }
  if (kind == Kind::binary_digits && type == Scalar::f32 && table.empty()) {
    const ScaledDigits digits = digits_of(*this);
    for (size_t i = 0; i < count; ++i) {
      const auto code = load<int32_t>(codes + i * stride * sizeof(int32_t));
      store(out + i * stride * sizeof(float), rounded_to<float>(digits.number_of(code)));
    }
    return;
  }
  for (size_t i = 0; i < count; ++i) {
    const size_t code_bytes = size_of(type) == 8 ? 8 : 4;
    const std::byte* code = codes + i * stride * code_bytes;
    store_number(type, code_bytes == 8 ? load<int64_t>(code) : load<int32_t>(code),
                 out + i * stride * size_of(type));
  }
}

bool NumberMap::is_curved() const {
  return kind == Kind::ordered || kind == Kind::binary_digits || kind == Kind::decimal_digits ||
         !table.empty();
}

double NumberMap::value_of(Scalar type, int64_t code) const {
  if (!table.empty()) return table[static_cast<size_t>(clamped_rank(code, table.size()))];
  if (factor != 0) return value_with_factor(*this, code);
  if (kind == Kind::binary_digits || kind == Kind::decimal_digits) return digits_of(*this).number_of(code);
  std::byte number[8];
  store_number(type, code, number);
  const double value = number_as_double(type, number);
  return value == value ? value : 0;
}

int64_t NumberMap::nearest_code(Scalar type, double value) const {
  if (!(value == value)) value = 0;
  if (!table.empty()) return nearer_rank(table, first_not_below(table, value), value);
  if (factor != 0) return code_with_factor(*this, value);
  if (kind == Kind::binary_digits || kind == Kind::decimal_digits) return digits_of(*this).code_of(value);
  switch (kind) {
    case Kind::decimal:
      return lattice_code(value * exact_powers_of_ten[exponent], 0, 1);
    case Kind::binary:
      return lattice_code(value * power_of_two(-exponent), 0, 1);
    case Kind::integer:
      return lattice_code(value, 0, 1);
    case Kind::lattice:
      return lattice_code(value, origin, step);
    case Kind::logarithm:
      return code_of_logarithm(*this, value);
    default:
      break;
  }
  std::byte number[8];
  store_rounded(type, value, number);
  return code_of(type, number);
}

double NumberMap::number_near(Scalar type, int64_t code) const {
  if (kind == Kind::integer && table.empty()) return static_cast<double>(code);
  const double value = value_of(type, code);
  return std::isfinite(value) ? value : 0;
}

}  // namespace maille
