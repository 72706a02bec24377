#include "volume/pieces/cut_rules.h"

#include "numbers/number_map.h"

namespace maille {
namespace {

float coordinate(const Array& positions, uint64_t number) {
  const double x =
      number_as_double(positions.type, positions.bytes.data() + number * size_of(positions.type));
  constexpr double most = 1e37;
  return x > -most && x < most ? static_cast<float>(x) : 0;
}

}  // namespace

std::array<float, 3> middle_of(const Array& positions, std::span<const uint32_t> points) {
  std::array<double, 3> sum{};
  for (const uint32_t point : points) {
    for (unsigned k = 0; k < 3; ++k) sum[k] += coordinate(positions, uint64_t{3} * point + k);
  }
  const double share = points.empty() ? 0 : 1 / static_cast<double>(points.size());
  std::array<float, 3> middle;
  for (unsigned k = 0; k < 3; ++k) middle[k] = static_cast<float>(sum[k] * share);
  return middle;
}

}  // namespace maille
