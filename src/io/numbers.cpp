#include "io/numbers.h"

#include <fast_float/fast_float.h>
#include <algorithm>
#include <cctype>
#include <cstdlib>

namespace maille {
namespace {

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// "1.#INF", "-1.#IND", "1.#QNAN00": how old MSVC runtimes print what is not a number. Digits behind the name
/// are padding to the precision asked for, and are passed over.
const char* parse_msvc(const char* p, const char* end, Number& number) {
  const bool negative = p != end && *p == '-';
  if (p != end && (*p == '-' || *p == '+')) ++p;
  if (end - p < 6 || std::string_view(p, 3) != "1.#") return nullptr;
  const std::string_view kind(p + 3, 3);
  if (kind == "INF") {
    number.value = std::numeric_limits<double>::infinity();
  } else if (kind == "IND" || kind == "QNA" || kind == "SNA") {
    number.value = std::numeric_limits<double>::quiet_NaN();
  } else {
    return nullptr;
  }
  for (p += 3; p != end && std::isalnum(static_cast<unsigned char>(*p)); ++p) {
  }
  if (negative) number.value = -number.value;
  number.single = static_cast<float>(number.value);
  number.fits_single = true;
  number.integer = false;
  return p;
}

/// The power of ten of the last digit written in [p, end), which is what the text says of its own precision:
/// -3 for "1.250", 2 for "3e2". The exponent stops at 100000, so that no text overflows it; doubles end long
/// before.
int exponent_of_last_digit(const char* p, const char* end) {
  int fraction = 0;
  bool behind_point = false;
  for (; p != end && *p != 'e' && *p != 'E'; ++p) {
    if (*p == '.') behind_point = true;
    if (is_digit(*p) && behind_point) ++fraction;
  }
  int exponent = 0;
  if (p != end) {
    const bool negative = ++p != end && *p == '-';
    for (; p != end; ++p) {
      if (is_digit(*p)) exponent = std::min(exponent * 10 + (*p - '0'), 100000);
    }
    if (negative) exponent = -exponent;
  }
  return exponent - fraction;
}

}  // namespace

bool is_beyond_double(const char* p, const char* end) {
  if (p != end && *p == '+') ++p;
  double value = 0;
  const char* const behind = fast_float::from_chars(p, end, value).ptr;
  return std::isinf(value) && std::any_of(p, behind, is_digit);
}

const char* parse_number_slow(const char* const begin, const char* end, Number& number) {
  const char* p = begin;
  if (p != end && *p == '+') ++p;
  if (p != begin && p != end && (*p == '-' || *p == '+')) return nullptr;
  const auto [behind, error] = fast_float::from_chars(p, end, number.value);
  if (error != std::errc()) return nullptr;
  if (behind != end && *behind == '#') {  // else the number ends here, before a comment
    if (const char* const behind_name = parse_msvc(begin, end, number)) return behind_name;
  }
  // fast_float also takes "nan" and "inf" in any case. They hold no digit, and a float holds them as well.
  const bool has_digits = std::any_of(p, behind, is_digit);
  number.integer = has_digits && std::all_of(p, behind, [](char c) { return is_digit(c) || c == '-'; });
  if (!has_digits) {  // nan, inf
    number.single = static_cast<float>(number.value);
    number.fits_single = true;
    return behind;
  }
  if (std::isinf(number.value)) return nullptr;
  // The double lies exactly between two floats, so the text itself must decide, as it may lie to either side.
  if (!round_to_single(number.value, number.single)) fast_float::from_chars(p, end, number.single);
  const double error_of_single = std::fabs(number.value - static_cast<double>(number.single));
  // Half a unit of the last digit written, and a little more, as in parse_number().
  number.fits_single = error_of_single == 0 ||
                       (std::isfinite(number.single) &&
                        error_of_single <= 0.5000001 * std::pow(10.0, exponent_of_last_digit(p, behind)));
  return behind;
}

}  // namespace maille
