#pragma once

#include <cmath>

namespace maille::testing {

// Sines that are the same on every machine, so that more meshes made of them are: those of C libraries differ
// in the last digit. Of check-determinism's 2,507 files WebAssembly had the input of 2,162 before, of 2,342
// now. Plain arithmetic is exact everywhere, as nothing is fused or reordered (CMakeLists.txt).

/// 1 - x / (k (k + 1)) (1 - x / ((k + 2) (k + 3)) (...)), x = r^2: Taylor's series of sin(r) / r with k = 2,
/// of cos(r) with k = 1. For |r| below pi / 4 what is left out is below 1e-17.
inline double taylor(double x, int k) {
  double sum = 1;
  for (int n = k + 14; n >= k; n -= 2) sum = 1 - x / (n * (n + 1)) * sum;
  return sum;
}

/// The sine of x and so many quarters of a turn, to the last digit or so for |x| below 10^6.
inline double sine(double x, int quarters = 0) {
  // Pi / 2 in two parts: the first has 33 bits, so that small multiples of it are exact.
  constexpr double high = 0x1.921fb544p0, low = 0x1.0b4611a626331p-34;
  const double turns = std::floor(x / (high + low) + 0.5);
  const double r = (x - turns * high) - turns * low;
  const double quarter = turns + quarters, in_turn = quarter - 4 * std::floor(quarter / 4);
  const double value = in_turn == 0 || in_turn == 2 ? r * taylor(r * r, 2) : taylor(r * r, 1);
  return in_turn < 2 ? value : -value;
}
inline double cosine(double x) {
  return sine(x, 1);
}

}  // namespace maille::testing
