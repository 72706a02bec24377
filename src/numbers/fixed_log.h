#pragma once

#include <cmath>

namespace maille {

/// A logarithm to base 2 for bounds relative to each number: e + f + f (1 - f) (a + b f) for 2^e (1 + f). Its
/// slope is within 1.5 % of that of the true one, which is all that a lattice needs, and a few products are
/// the same on every machine, which log2() is not. The cubic is the one that has the values and slopes of
/// log2 at both ends of an octave: it is continuous, and so is its slope. docs/format.md, 10.6 (`power`).
class FixedLog {
 public:
  /// x is positive and finite.
  static double of(double x) {
    int exponent;
    const double f = 2 * std::frexp(x, &exponent) - 1;
    return exponent - 1 + curve(f);
  }
  /// The inverse; `log` is from -2000 to 2000.
  static double power(double log) {
    const double whole = std::floor(log);
    const double rest = log - whole;
    double f = rest;
    // Newton's method: three steps are exact to 2^-50, from a start that is off by 0.1 at most.
    for (int i = 0; i < 4; ++i) f -= (curve(f) - rest) / slope(f);
    return std::ldexp(1 + f, static_cast<int>(whole));
  }

 private:
  // The slope of the true logarithm at both ends, 1 / ln 2 and half of it: a is 1 / ln 2 - 1, and 1 - (a + b)
  // is 1 / (2 ln 2).
  static constexpr double a = 0.4426950408889634;
  static constexpr double b = -0.16404256133344508;
  static double curve(double f) { return f + f * (1 - f) * (a + b * f); }
  static double slope(double f) { return 1 + (1 - 2 * f) * (a + b * f) + f * (1 - f) * b; }
};

}  // namespace maille
