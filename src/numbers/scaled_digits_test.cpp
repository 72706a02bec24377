#include "numbers/scaled_digits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include <rapidcheck/gtest.h>

#include "base/bytes.h"

namespace maille {
namespace {

TEST(ScaledDigits, CountNumbersFromZero) {
  const ScaledDigits two{10, 2, -1};  // 0, .1, ... 9.9, 10, 11, ... 99, 100, 110, ...
  EXPECT_EQ(two.number_of(0), 0);
  EXPECT_EQ(two.number_of(99), 9.9);
  EXPECT_EQ(two.number_of(100), 10);
  EXPECT_EQ(two.number_of(101), 11);
  EXPECT_EQ(two.number_of(190), 100);
  EXPECT_EQ(two.number_of(191), 110);
  EXPECT_EQ(two.code_of(110), 191);
  EXPECT_EQ(two.code_of(9.94), 99);
  EXPECT_EQ(two.code_of(9.96), 100);
  EXPECT_EQ(two.last_place(0), -1);
  EXPECT_EQ(two.last_place(9.96), 0);
  EXPECT_EQ(two.last_place(99), 0);
  EXPECT_EQ(two.last_place(99.6), 1);
}

TEST(ScaledDigits, TellNegativeZeroFromZero) {
  const ScaledDigits digits{10, 3, -2};
  EXPECT_EQ(digits.code_of(-0.0), -1);
  EXPECT_TRUE(std::signbit(digits.number_of(-1)));
  EXPECT_EQ(digits.code_of(-1e-9), 0) << "what rounds to zero is no negative zero";
  EXPECT_EQ(digits.code_of(-0.01), -2);
  EXPECT_EQ(digits.number_of(-2), -0.01);
}

/// The extremes of digits and exponents, and all codes that numbers have.
RC_GTEST_PROP(ScaledDigits, CodesComeBack, (uint64_t seed, bool wide, bool decimal)) {
  const uint32_t base = decimal ? 10 : 2;
  // Doubles tell all decimals of 15 digits apart, not of 16.
  const uint32_t most_digits = decimal && wide ? 15 : ScaledDigits::most_digits(base, wide);
  const uint32_t digits = 1 + static_cast<uint32_t>(seed % most_digits);
  // Where ten to the exponent is exact, so are all numbers.
  const int32_t least = decimal ? -22 : ScaledDigits::least_exponent(2);
  const int32_t most = decimal ? 5 : ScaledDigits::most_exponent(2) - 60;
  const auto exponent =
      static_cast<int32_t>(least + static_cast<int32_t>((seed >> 8) % static_cast<uint64_t>(most - least)));
  const ScaledDigits map{base, digits, exponent};
  const auto bits = static_cast<unsigned>(seed >> 58);
  // Not beyond 10^22 or the largest double.
  const int64_t farthest = map.code_of(decimal ? 1e22 : 1e300);
  const int64_t code = static_cast<int64_t>(seed * 0x9e3779b97f4a7c15 >> (1 + bits)) % (farthest + 1);
  RC_ASSERT(map.code_of(map.number_of(code)) == code);
  RC_ASSERT(map.code_of(map.number_of(-1 - code)) == -1 - code);
  RC_ASSERT(map.number_of(code) < map.number_of(code + 1));
  RC_ASSERT(map.code_of(-map.number_of(code)) == -1 - code);
}

RC_GTEST_PROP(ScaledDigits, FloatsAreThemselves, (uint32_t bits, uint64_t wide_bits)) {
  const auto number = bits_as<float>(bits);
  const auto wide = bits_as<double>(wide_bits);
  const ScaledDigits floats{2, 24, -149}, doubles{2, 53, -1074};
  if (std::isfinite(number)) {
    const int64_t code = floats.code_of(static_cast<double>(number));
    RC_ASSERT(bits_as<uint32_t>(static_cast<float>(floats.number_of(code))) == bits);
    RC_ASSERT(code == static_cast<int32_t>(code));
    RC_ASSERT((code < 0 ? -1 - code : code) == static_cast<int64_t>(bits & 0x7fffffff));
  }
  if (std::isfinite(wide))
    RC_ASSERT(bits_as<uint64_t>(doubles.number_of(doubles.code_of(wide))) == wide_bits);
}

TEST(ScaledDigits, NumbersAreThoseThatTextGives) {
  const ScaledDigits six{10, 6, -12};
  for (const char* text : {"1e-12", "0.000123456", "-98765.4", "3.14159", "1e22", "999999e-12", "123456e3"}) {
    const double number = std::strtod(text, nullptr);
    EXPECT_EQ(six.number_of(six.code_of(number)), number) << text;
  }
}

TEST(ScaledDigits, TakeAnyNumberAndAnyCode) {
  for (const uint32_t base : {2u, 10u}) {
    for (const int32_t exponent :
         {ScaledDigits::least_exponent(base), 0, ScaledDigits::most_exponent(base)}) {
      const ScaledDigits map{base, ScaledDigits::most_digits(base, true), exponent};
      for (const double number : {0.0, 5e-324, 1e-300, 1.0, 1.7976931348623157e308}) {
        EXPECT_GE(map.code_of(number), 0);
        EXPECT_LE(map.code_of(-number), 0);
      }
      EXPECT_EQ(map.code_of(std::numeric_limits<double>::quiet_NaN()), 0);
      EXPECT_EQ(map.code_of(std::numeric_limits<double>::infinity()),
                map.code_of(std::numeric_limits<double>::max()));
      for (const int64_t code : {INT64_MIN, INT64_MIN + 1, INT64_MAX})
        EXPECT_EQ(map.number_of(code), map.number_of(code));
    }
  }
}

}  // namespace
}  // namespace maille
