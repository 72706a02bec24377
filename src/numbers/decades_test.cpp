#include "numbers/decades.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <cmath>
#include <limits>

namespace maille {
namespace {

void expect_same_code(const Decades& decades, const ScaledDigits& digits, double number) {
  ASSERT_EQ(decades.code_of(number), digits.code_of(number))
      << number << " of " << digits.digits << " digits";
  ASSERT_EQ(decades.code_of(-number), digits.code_of(-number)) << -number;
}
void expect_same_number(const Decades& decades, const ScaledDigits& digits, int64_t code) {
  const double found = decades.number_of(code), wanted = digits.number_of(code);
  ASSERT_EQ(bits_as<uint64_t>(found), bits_as<uint64_t>(wanted)) << code;
}

RC_GTEST_PROP(Decades, MapAsTheDigitsDo, ()) {
  const ScaledDigits digits{10, *rc::gen::inRange(1u, 16u), *rc::gen::inRange(-22, 0)};
  const Decades decades(digits);
  RC_ASSERT(!decades.empty());
  const auto mantissa = static_cast<double>(*rc::gen::inRange<int64_t>(0, 10'000'000'000'000'000));
  const double number = mantissa * std::pow(10.0, *rc::gen::inRange(-40, 10));
  RC_ASSERT(decades.code_of(number) == digits.code_of(number));
  RC_ASSERT(decades.code_of(-number) == digits.code_of(-number));
  const int64_t code = digits.code_of(*rc::gen::element(number, -number)) + *rc::gen::inRange(-3, 4);
  RC_ASSERT(bits_as<uint64_t>(decades.number_of(code)) == bits_as<uint64_t>(digits.number_of(code)));
}

TEST(Decades, AgreeWithTheDigitsAroundEveryDecadeAndBinade) {
  for (const uint32_t count : {1u, 6u, 7u, 9u, 15u}) {
    const ScaledDigits digits{10, count, -9};
    const Decades decades(digits);
    for (int power = -30; power < 25; ++power) {
      for (double number : {std::pow(10.0, power), std::ldexp(1.0, power * 3),
                            (std::pow(10.0, count) - 0.5) * std::pow(10.0, power)}) {
        for (int i = 0; i < 4; ++i) number = std::nextafter(number, 0.0);
        for (int i = 0; i < 8; ++i) {
          expect_same_code(decades, digits, number);
          number = std::nextafter(number, std::numeric_limits<double>::max());
        }
        const int64_t code = digits.code_of(number);
        for (int64_t near = code - 4; near < code + 4; ++near) expect_same_number(decades, digits, near);
      }
    }
  }
}

TEST(Decades, TakeAnyNumberAndAnyCode) {
  const ScaledDigits digits{10, 6, -6};
  const Decades decades(digits);
  for (const double number : {0.0, -0.0, 1e300, 5e-324, std::numeric_limits<double>::infinity(),
                              std::numeric_limits<double>::quiet_NaN()})
    expect_same_code(decades, digits, number);
  for (const int64_t code : {INT64_MIN, INT64_MIN + 1, int64_t{-1}, int64_t{0}, INT64_MAX - 1, INT64_MAX})
    expect_same_number(decades, digits, code);
}

TEST(Decades, AreEmptyForDigitsThatDoublesDoNotScaleExactly) {
  EXPECT_TRUE(Decades(ScaledDigits{2, 24, -149}).empty());
  EXPECT_TRUE(Decades(ScaledDigits{10, 16, -9}).empty());
  EXPECT_TRUE(Decades(ScaledDigits{10, 6, -23}).empty());
  EXPECT_TRUE(Decades(ScaledDigits{10, 6, 0}).empty());
}

}  // namespace
}  // namespace maille
