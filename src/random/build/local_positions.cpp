#include "random/build/local_positions.h"

#include <algorithm>
#include <cmath>

#include "numbers/number_map.h"

namespace maille {
namespace {

// A little below the largest float, 3.4e38.
constexpr double most = 3e38;

/// Differences of these neither overflow nor are infinite.
double usable(double number) {
  return std::isfinite(number) ? std::clamp(number, -most / 4, most / 4) : 0;
}

std::vector<double> usable_numbers(const ArrayToCode& positions) {
  std::vector<double> numbers;
  for (const Place& place : decoded_places(positions)) {
    for (const uint64_t& bits : place)
      numbers.push_back(usable_number(positions.array->type, reinterpret_cast<const std::byte*>(&bits)));
  }
  return numbers;
}

LocalPositions around(const Vector3& origin, const std::vector<double>& numbers) {
  LocalPositions local;
  local.origin = origin;
  for (size_t i = 0; i < numbers.size(); ++i) {
    const double middle = local.origin.x[i % 3];
    const auto number = static_cast<float>(numbers[i] - middle);
    local.numbers.push_back(number);
    // Spheres and boxes in the index grow by the largest rounding, so that they hold the positions
    // themselves.
    local.rounding = std::max(local.rounding, std::abs(numbers[i] - (middle + static_cast<double>(number))));
  }
  return local;
}

}  // namespace

bool floats_hold(Scalar type) {
  return type == Scalar::f32 || size_of(type) < 4;
}

double usable_number(Scalar type, const std::byte* number) {
  return usable(number_as_double(type, number));
}

LocalPositions local_positions(const ArrayToCode& positions, const Vector3& origin, Executor& executor) {
  LocalPositions local;
  if (!floats_hold(positions.array->type)) return around(origin, usable_numbers(positions));
  local.numbers = decoded_floats(positions, executor);
  return local;
}

LocalPositions local_positions(const ArrayToCode& positions, Executor& executor) {
  if (floats_hold(positions.array->type)) return local_positions(positions, {}, executor);
  const std::vector<double> numbers = usable_numbers(positions);
  Vector3 origin;
  for (size_t k = 0; k < 3 && !numbers.empty(); ++k) {
    double low = numbers[k], high = numbers[k];
    for (size_t i = k; i < numbers.size(); i += 3) {
      low = std::min(low, numbers[i]);
      high = std::max(high, numbers[i]);
    }
    // Halves are added, as the sum of two large numbers could overflow.
    origin.x[k] = low / 2 + high / 2;
  }
  return around(origin, numbers);
}

}  // namespace maille
