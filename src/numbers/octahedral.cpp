#include "numbers/octahedral.h"

#include <algorithm>
#include <cmath>

#include "numbers/number_map.h"

namespace maille {
namespace {

using Vector = std::array<double, 3>;

Vector vector_at(const Array& array, uint64_t tuple) {
  Vector vector;
  for (size_t k = 0; k < 3; ++k) {
    vector[k] = number_as_double(array.type, array.bytes.data() + (tuple * 3 + k) * size_of(array.type));
  }
  return vector;
}

bool is_unit(const Vector& v) {
  const double square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
  return square > 0.9999 && square < 1.0001;  // false for NaN
}

/// A call of its own: GCC 12 drops the pair of conversions to float and back where it vectorises them.
[[gnu::noinline]] double as_float(double x) {
  return static_cast<float>(x);
}

/// Decoded numbers as the array will hold them.
Vector rounded(const Array& array, Vector v) {
  if (array.type == Scalar::f32) {
    for (double& x : v) x = as_float(x);
  }
  return v;
}

double largest_difference(const Vector& a, const Vector& b) {
  return std::max({std::fabs(a[0] - b[0]), std::fabs(a[1] - b[1]), std::fabs(a[2] - b[2])});
}

/// Codes within the square. On its rim, opposite places of an edge are one direction.
std::array<int32_t, 2> on_square(int32_t i, int32_t j, int32_t steps) {
  i = std::clamp(i, -steps, steps);
  j = std::clamp(j, -steps, steps);
  if (std::abs(i) == steps) j = std::abs(j);
  if (std::abs(j) == steps) i = std::abs(i);
  return {i, j};
}

/// Whole number of steps nearest to 2^(index / 16).
int32_t steps_at(int32_t index) {
  return static_cast<int32_t>(std::floor(sixteenth_of_octave(index) + 0.5));
}

/// Are all unit vectors exactly decoded ones? Then they were decoded with this map and must fall on it again.
bool lies_on(const Array& array, const OctahedralMap& map) {
  for (uint64_t i = 0; i < array.count(); ++i) {
    const Vector v = vector_at(array, i);
    if (is_unit(v) && rounded(array, map.vector_of(map.codes_of(v))) != v) return false;
  }
  return true;
}

double widest_range(const Array& array) {
  Vector low = {2, 2, 2};
  Vector high = {-2, -2, -2};
  for (uint64_t i = 0; i < array.count(); ++i) {
    const Vector v = vector_at(array, i);
    if (!is_unit(v)) continue;
    for (size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], v[k]);
      high[k] = std::max(high[k], v[k]);
    }
  }
  return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
}

/// Steps for a tolerance; 0 for one that makes none. Decoding moves the range of the vectors a little, so a
/// relative bound takes one of 16 numbers of steps to the octave, and the one the vectors lie on already.
int32_t steps_for(const Array& array, const Tolerance& tolerance) {
  if (tolerance.kind == Tolerance::Kind::bits) {
    // Codes from -steps to steps are 2^bits - 1 numbers.
    return tolerance.value >= 2 && tolerance.value <= 26 ? (1 << (static_cast<int>(tolerance.value) - 1)) - 1
                                                         : 0;
  }
  const double range = tolerance.kind == Tolerance::Kind::relative ? widest_range(array) : 1;
  const double wanted = OctahedralMap{1}.bound() / (tolerance.value * range);
  if (!(wanted < most_octahedral_steps)) return 0;
  if (tolerance.kind == Tolerance::Kind::absolute)
    return std::max(static_cast<int32_t>(std::ceil(wanted)), 1);
  int32_t index = 0;
  while (steps_at(index) < wanted) ++index;
  for (const int32_t i : {index, index + 1, std::max(index - 1, 0)}) {
    if (lies_on(array, {steps_at(i)})) return steps_at(i);
  }
  return steps_at(index);
}

}  // namespace

std::array<int32_t, 2> OctahedralMap::codes_of(const Vector& vector) const {
  const double sum = std::fabs(vector[0]) + std::fabs(vector[1]) + std::fabs(vector[2]);
  double x = vector[0] / sum;
  double y = vector[1] / sum;
  // The lower half is folded out: |x| and |y| become 1 - |y| and 1 - |x|, and signs stay.
  if (vector[2] < 0) {
    const double folded = (1 - std::fabs(y)) * (x < 0 ? -1 : 1);
    y = (1 - std::fabs(x)) * (y < 0 ? -1 : 1);
    x = folded;
  }
  const auto low_x = static_cast<int32_t>(std::floor(x * steps));
  const auto low_y = static_cast<int32_t>(std::floor(y * steps));
  std::array<int32_t, 2> best = {};
  double smallest = 8;
  for (const int32_t i : {low_x, low_x + 1}) {
    for (const int32_t j : {low_y, low_y + 1}) {
      const auto codes = on_square(i, j, steps);
      const double error = largest_difference(vector_of(codes), vector);
      if (error >= smallest) continue;
      smallest = error;
      best = codes;
    }
  }
  return best;
}

std::array<double, 3> OctahedralMap::vector_of(std::array<int32_t, 2> codes) const {
  double x = static_cast<double>(codes[0]) / steps;
  double y = static_cast<double>(codes[1]) / steps;
  const double z = 1 - std::fabs(x) - std::fabs(y);
  if (z < 0) {
    const double folded = (1 - std::fabs(y)) * (x < 0 ? -1 : 1);
    y = (1 - std::fabs(x)) * (y < 0 ? -1 : 1);
    x = folded;
  }
  const double length = std::sqrt(x * x + y * y + z * z);
  return {x / length, y / length, z / length};
}

std::optional<OctahedralChoice> choose_octahedral_map(const Array& array, const Tolerance& tolerance) {
  if (array.role != Role::normal || array.components != 3 || !is_float(array.type)) return std::nullopt;
  OctahedralChoice choice;
  for (uint64_t i = 0; i < array.count(); ++i) {
    if (is_unit(vector_at(array, i))) continue;
    for (uint64_t k = 0; k < 3; ++k) choice.exceptions.push_back(3 * i + k);
    if (choice.exceptions.size() / 3 > array.count() / 64) return std::nullopt;
  }
  choice.map.steps = steps_for(array, tolerance);
  if (choice.map.steps == 0) return std::nullopt;
  for (uint64_t i = 0; i < array.count(); ++i) {
    const Vector v = vector_at(array, i);
    if (!is_unit(v)) continue;
    const double error = largest_difference(rounded(array, choice.map.vector_of(choice.map.codes_of(v))), v);
    choice.maximum_error = std::max(choice.maximum_error, error);
  }
  const bool bounded = tolerance.kind != Tolerance::Kind::bits;
  const double bound =
      tolerance.kind == Tolerance::Kind::relative ? tolerance.value * widest_range(array) : tolerance.value;
  // Lengths may differ from 1 by 5e-5, which decoding does not restore. An array that breaks a finer bound in
  // this way is coded by a lattice.
  if (bounded && choice.maximum_error > bound) return std::nullopt;
  return choice;
}

}  // namespace maille
