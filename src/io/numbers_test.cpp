#include "io/numbers.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string>

namespace maille {
namespace {

Number parsed(const std::string& text) {
  Number number;
  const char* const behind = parse_number(text.data(), text.data() + text.size(), number);
  EXPECT_EQ(behind, text.data() + text.size()) << text;
  return number;
}

bool parses(const std::string& text) {
  Number number;
  return parse_number(text.data(), text.data() + text.size(), number) == text.data() + text.size();
}

template <class T>
std::string shortest(T value) {
  char text[40];
  return std::string(text, std::to_chars(text, text + 40, value).ptr);
}

TEST(ParseNumber, ReadsTheUsualForms) {
  EXPECT_EQ(parsed("0").value, 0);
  EXPECT_EQ(parsed("-12.5").value, -12.5);
  EXPECT_EQ(parsed("+3").value, 3);
  EXPECT_EQ(parsed("1.").value, 1);
  EXPECT_EQ(parsed(".5").value, 0.5);
  EXPECT_EQ(parsed("1e3").value, 1000);
  EXPECT_EQ(parsed("-2.5E-3").value, -0.0025);
  EXPECT_TRUE(std::signbit(parsed("-0").value));
  EXPECT_TRUE(std::signbit(parsed("-0.0").single));
}

TEST(ParseNumber, ReadsWhatIsNotANumber) {
  EXPECT_TRUE(std::isnan(parsed("nan").value));
  EXPECT_TRUE(std::isnan(parsed("-nan").value));
  EXPECT_TRUE(std::signbit(parsed("-nan").single));
  EXPECT_EQ(parsed("inf").value, HUGE_VAL);
  EXPECT_EQ(parsed("-inf").value, -HUGE_VAL);
  EXPECT_EQ(parsed("-1.#INF").value, -HUGE_VAL);
  EXPECT_EQ(parsed("1.#INF00").value, HUGE_VAL);
  EXPECT_TRUE(std::isnan(parsed("1.#QNAN").value));
  EXPECT_TRUE(std::isnan(parsed("-1.#IND00").value));
}

TEST(ParseNumber, RejectsWhatIsNone) {
  for (const char* text : {"", "-", "+", ".", "e5", "abc", "+-1", "--1", "1e999", "-1e999", "1.#XYZ"}) {
    EXPECT_FALSE(parses(text)) << text;
  }
}

TEST(ParseNumber, TakesWhatIsBelowDoubleForZero) {
  EXPECT_EQ(parsed("1e-400").value, 0);
  EXPECT_TRUE(std::signbit(parsed("-1e-400").value));
}

TEST(IsBeyondDouble, TellsLargeNumbersFromOtherText) {
  for (const std::string text : {"1e400", "-1e999", "+1e309 ", "2e308,"}) {
    EXPECT_TRUE(is_beyond_double(text.data(), text.data() + text.size())) << text;
  }
  for (const std::string text : {"", "1e308", "inf", "-inf", "nan", "1e-400", "abc", "1e", "+", "-"}) {
    EXPECT_FALSE(is_beyond_double(text.data(), text.data() + text.size())) << text;
  }
}

TEST(ParseNumber, StaysInsideItsText) {
  const std::string text = "1234567";
  for (size_t length = 1; length <= text.size(); ++length) {
    Number number;
    EXPECT_EQ(parse_number(text.data(), text.data() + length, number), text.data() + length);
    EXPECT_EQ(number.value, std::stod(text.substr(0, length)));
  }
}

TEST(ParseNumber, KnowsWhatAFloatHolds) {
  for (const char* text : {"0.1", "93.425102", "1.0", "0.0500000007", "3.4028235e38", "1e-45",
                           "0.10000000149011612", "448262.12", "-0", "123456", "1e10"}) {
    EXPECT_TRUE(parsed(text).fits_single) << text;
  }
  for (const char* text : {"0.10000000000000001", "2594140.20", "0.35444599999999998", "1e39", "1e-60",
                           "16777217", "16777217.0e-3", "0.1234567891", "448262.15"}) {
    EXPECT_FALSE(parsed(text).fits_single) << text;
  }
}

TEST(ParseNumber, KnowsWholeNumbers) {
  EXPECT_TRUE(parsed("255").integer);
  EXPECT_TRUE(parsed("-1").integer);
  EXPECT_TRUE(parsed("12345678901234567890").integer);
  EXPECT_FALSE(parsed("255.0").integer);
  EXPECT_FALSE(parsed("1e2").integer);
  EXPECT_FALSE(parsed("nan").integer);
}

RC_GTEST_PROP(ParseNumber, GivesBackEveryFloat, (uint32_t bits)) {
  float value;
  std::memcpy(&value, &bits, sizeof value);
  RC_PRE(!std::isnan(value));
  const Number number = parsed(shortest(value));
  RC_ASSERT(std::memcmp(&number.single, &value, sizeof value) == 0);
  RC_ASSERT(number.fits_single);
}

RC_GTEST_PROP(ParseNumber, GivesBackEveryDouble, (uint64_t bits)) {
  double value;
  std::memcpy(&value, &bits, sizeof value);
  RC_PRE(!std::isnan(value));
  const Number number = parsed(shortest(value));
  RC_ASSERT(std::memcmp(&number.value, &value, sizeof value) == 0);
}

/// The C library rounds decimals to float correctly; so must we, also where rounding to double first would
/// not.
RC_GTEST_PROP(ParseNumber, RoundsDecimalsLikeTheLibrary, (uint64_t digits, uint8_t length, int8_t exponent)) {
  std::string text = std::to_string(digits).substr(0, length % 20 + 1);
  if (length & 32) text.insert(text.size() / 2, ".");
  if (length & 64) text += "e" + std::to_string(exponent % 40);
  const Number number = parsed(text);
  RC_ASSERT(number.value == std::strtod(text.c_str(), nullptr));
  RC_ASSERT(number.single == std::strtof(text.c_str(), nullptr));
}

TEST(ParseNumber, RoundsOnceAtTheMiddleOfTwoFloats) {
  // 1 + 2^-24 lies between two floats; a digit far behind decides, and a double does not hold it.
  EXPECT_EQ(parsed("1.000000059604644775390625").single, 1.0f);
  EXPECT_EQ(parsed("1.000000059604644775390626").single, std::nextafter(1.0f, 2.0f));
  EXPECT_EQ(parsed("8388608.5").single, 8388608.0f);
}

}  // namespace
}  // namespace maille
