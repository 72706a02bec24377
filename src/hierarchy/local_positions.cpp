#include "hierarchy/local_positions.h"

#include <algorithm>
#include <cmath>

#include "mesh/number_map.h"

namespace maille {
namespace {

constexpr double most = 3e38;

bool floats_hold(Scalar type) {
  return type == Scalar::f32 || size_of(type) < 4;
}

/// Differences of these neither overflow nor are infinite.
double usable(double number) {
  return std::isfinite(number) ? std::clamp(number, -most / 4, most / 4) : 0;
}

}  // namespace

LocalPositions local_positions(const ArrayToCode& positions, Executor& executor) {
  LocalPositions local;
  const Scalar type = positions.array->type;
  if (floats_hold(type)) {
    local.numbers = decoded_floats(positions, executor);
    return local;
  }
  std::vector<double> numbers;
  for (const Place& place : decoded_places(positions)) {
    for (const uint64_t& bits : place)
      numbers.push_back(usable(number_as_double(type, reinterpret_cast<const std::byte*>(&bits))));
  }
  for (size_t k = 0; k < 3 && !numbers.empty(); ++k) {
    double low = numbers[k], high = numbers[k];
    for (size_t i = k; i < numbers.size(); i += 3) {
      low = std::min(low, numbers[i]);
      high = std::max(high, numbers[i]);
    }
    local.origin.x[k] = low / 2 + high / 2;
  }
  for (size_t i = 0; i < numbers.size(); ++i) {
    const double origin = local.origin.x[i % 3];
    const auto number = static_cast<float>(numbers[i] - origin);
    local.numbers.push_back(number);
    local.rounding = std::max(local.rounding, std::abs(numbers[i] - (origin + static_cast<double>(number))));
  }
  return local;
}

}  // namespace maille
