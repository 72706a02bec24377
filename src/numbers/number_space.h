#pragma once

#include <array>
#include <memory>

#include "code/residual_model.h"
#include "numbers/decimal_floats.h"
#include "numbers/float_bits.h"
#include "numbers/number_map.h"
#include "numbers/scaled_digits.h"

namespace maille {

/// Numbers written with a few significant digits, as most text files have them: counted from zero upwards.
/// Where a float has seven digits and the file had six, this saves four bits a number; decimal fractions have
/// too many digits for the large numbers. Of kind `ordered`, with the number of digits as exponent. Code 0 is
/// zero, then come 9 * 10^(digits - 1) codes for each decade from 10^-6 on. (Mode `stream` only; surfaces
/// have ScaledDigits for this, whose last digit is a parameter.)
class SignificantDigits {
 public:
  SignificantDigits() = default;
  explicit SignificantDigits(int digits) : digits_(digits), first_(whole_power(digits - 1)) {}
  explicit operator bool() const { return digits_ != 0; }

  /// Nearest; 0 for what is out of range (which store_number does not give back).
  int64_t code_of(double number) const {
    const double size = number < 0 ? -number : number;
    if (!(size >= smallest && size < largest)) return 0;
    int exponent = exponent_of(size);
    auto mantissa = static_cast<int64_t>(scaled(size, digits_ - 1 - exponent) + 0.5);
    // Rounded up into the next decade.
    if (mantissa >= 10 * first_) {
      mantissa = first_;
      ++exponent;
    }
    if (mantissa < first_) mantissa = first_;
    const int64_t code = (exponent - least_exponent) * 9 * first_ + mantissa - first_ + 1;
    return number < 0 ? -code : code;
  }
  double number_of(int64_t code) const {
    const bool negative = code < 0;
    const uint64_t count = negative ? -static_cast<uint64_t>(code) : static_cast<uint64_t>(code);
    if (count == 0) return 0;
    const uint64_t decade = (count - 1) / static_cast<uint64_t>(9 * first_);
    if (decade > static_cast<uint64_t>(most_exponent - least_exponent)) return 0;
    const auto mantissa = static_cast<int64_t>((count - 1) % static_cast<uint64_t>(9 * first_)) + first_;
    const int exponent = static_cast<int>(decade) + least_exponent;
    const double size = scaled(static_cast<double>(mantissa), exponent - digits_ + 1);
    return negative ? -size : size;
  }
  /// Half octaves of the distance of neighbours there.
  int unit_at(double place) const {
    const double size = place < 0 ? -place : place;
    const int exponent = size >= smallest && size < largest ? exponent_of(size) : least_exponent;
    return (exponent - digits_ + 1) * 6644 / 1000;
  }
  /// The decimal exponent of a size: from the binary one times log10(2), 1233 / 4096, which is off by one at
  /// most, and then put right by comparing.
  int exponent_of(double size) const {
    int exponent =
        static_cast<int>((static_cast<int64_t>(bits_as<uint64_t>(size) >> 52) - 1023) * 1233 >> 12);
    if (exponent < least_exponent) exponent = least_exponent;
    if (scaled(size, -exponent) >= 10) ++exponent;
    if (scaled(size, -exponent) < 1) --exponent;
    return exponent < least_exponent ? least_exponent : exponent;
  }

 private:
  // Powers up to 10^22 are doubles, so that a product or quotient with one is what a parser makes of the
  // text.
  static constexpr int least_exponent = -6;
  static constexpr int most_exponent = 14;
  static constexpr double smallest = 1e-6;
  static constexpr double largest = 1e15;
  static constexpr int64_t whole_power(int exponent) {
    int64_t power = 1;
    for (int i = 0; i < exponent; ++i) power *= 10;
    return power;
  }
  static double scaled(double value, int exponent) {
    return exponent < 0 ? value / exact_powers_of_ten[-exponent] : value * exact_powers_of_ten[exponent];
  }

  int digits_ = 0;
  int64_t first_ = 1;
};

/// Where the numbers of one component lie, for prediction: floats that keep their bits, and those of a table,
/// at their value, all others at their code. Predictions are made in doubles there, residuals between codes.
/// Doubles with a factor are the floats that it belongs to. For volumes; it adds to NumberMap the kinds of
/// digits that mode `stream` has, and takes any code without undefined behaviour, as that does.
class NumberSpace {
 public:
  NumberSpace(Scalar type, const NumberMap& map)
      : type_(map.factor != 0 ? Scalar::f32 : type),
        factor_(map.factor),
        map_(without_factor(map)),
        ordered_(map.kind == NumberMap::Kind::ordered && map.exponent == 0 && map.table.empty()) {
    if (map.kind != NumberMap::Kind::ordered || !map.table.empty()) return;
    if (map.exponent > 0) digits_ = SignificantDigits(map.exponent);
    if (map.exponent < 0) decimals_ = DecimalFloats(-map.exponent);
  }

  /// A float that keeps its bits.
  bool is_float() const { return is_plain() && type_ == Scalar::f32; }
  /// A float or double that does.
  bool is_plain() const { return ordered_ && factor_ == 0 && (type_ == Scalar::f32 || type_ == Scalar::f64); }
  bool exact() const {
    return factor_ == 0 && (ordered_ || (map_->kind == NumberMap::Kind::integer && map_->table.empty()));
  }
  /// Errors are relative to each number.
  bool is_logarithm() const { return map_->kind == NumberMap::Kind::logarithm; }
  int64_t code_of(const std::byte* number) const {
    if (factor_ == 0) return plain_code_of(number);
    std::array<std::byte, 8> plain;
    store(plain.data(), narrowed_bits(load<double>(number) / factor_));
    return plain_code_of(plain.data());
  }
  void store_number(int64_t code, std::byte* out) const {
    if (factor_ == 0) return store_plain(code, out);
    std::array<std::byte, 8> bytes{};
    store_plain(code, bytes.data());
    const auto plain = load<float>(bytes.data());
    if (plain == plain) return store(out, static_cast<double>(plain) * factor_);
    store(out, widened_bits(load<uint32_t>(bytes.data())));
  }
  double place_of(int64_t code) const {
    if (digits_) return digits_.number_of(code);
    if (decimals_) return decimals_.number_of(code);
    if (!map_->table.empty()) return map_->value_of(type_, code);
    if (!ordered_) return static_cast<double>(code);
    if (type_ != Scalar::f32) return map_->value_of(type_, code);
    const auto value = bits_as<float>(ordered(static_cast<int32_t>(code)));
    return value == value ? static_cast<double>(value) : 0;
  }
  int64_t code_near(double place) const {
    if (!map_->table.empty()) return map_->nearest_code(type_, place);
    if (ordered_) {
      constexpr double largest = 3.4028234663852886e38;
      if (type_ != Scalar::f32) return map_->nearest_code(type_, place);
      if (!(place == place)) return 0;
      return ordered_bits(static_cast<float>(place < -largest  ? -largest
                                             : place > largest ? largest
                                                               : place));
    }
    if (digits_) return digits_.code_of(place);
    if (decimals_) return decimals_.code_of(place);
    // Below 2^63, from which on the cast would be undefined.
    constexpr double most = 9.0e18;
    if (!(place == place)) return 0;
    if (place > most || place < -most)
      return place < 0 ? -int64_t{9'000'000'000'000'000'000} : int64_t{9'000'000'000'000'000'000};
    const auto whole = static_cast<int64_t>(place);
    const double rest = place - static_cast<double>(whole);
    return whole + (rest >= 0.5) - (rest < -0.5);
  }
  /// Half octaves of the distance between neighbouring codes there.
  int unit_at(double place) const {
    if (digits_) return digits_.unit_at(place);
    if (decimals_) return decimals_.unit_at(place);
    if (!ordered_) return 0;
    const int bits = type_ == Scalar::f32 ? 23 : 52;
    // Denormal numbers are as far apart as the least normal ones.
    const int least = type_ == Scalar::f32 ? -126 : -1022;
    const int exponent = static_cast<int>(bits_as<uint64_t>(place) >> 52 & 0x7ff) - 1023;
    return 2 * ((exponent < least ? least : exponent) - bits);
  }

 private:
  int64_t plain_code_of(const std::byte* number) const {
    if (ordered_ && type_ == Scalar::f32) return ordered(load<int32_t>(number));
    if (digits_) return digits_.code_of(number_as_double(type_, number));
    if (decimals_) return decimals_.code_of(number_as_double(type_, number));
    return map_->code_of(type_, number);
  }
  void store_plain(int64_t code, std::byte* out) const {
    if (ordered_ && type_ == Scalar::f32) return store(out, ordered(static_cast<int32_t>(code)));
    if (digits_) {
      const double value = digits_.number_of(code);
      return type_ == Scalar::f32 ? store(out, static_cast<float>(value)) : store(out, value);
    }
    if (decimals_) return store(out, static_cast<float>(decimals_.number_of(code)));
    map_->store_number(type_, code, out);
  }

  static std::shared_ptr<const NumberMap> without_factor(NumberMap map) {
    map.factor = 0;
    return std::make_shared<const NumberMap>(std::move(map));
  }

  Scalar type_;
  double factor_;                         ///< 0: none
  std::shared_ptr<const NumberMap> map_;  ///< shared by copies, as tables are large
  bool ordered_;
  SignificantDigits digits_;
  DecimalFloats decimals_;
};

}  // namespace maille
