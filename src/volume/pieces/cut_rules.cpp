#include "volume/pieces/cut_rules.h"

#include "numbers/number_map.h"

namespace maille {

void MiddleSum::add(Scalar type, const std::byte* position) {
  constexpr double most = 1e37;
  for (unsigned k = 0; k < 3; ++k) {
    const double x = number_as_double(type, position + k * size_of(type));
    sum_[k] += x > -most && x < most ? static_cast<double>(static_cast<float>(x)) : 0;
  }
  ++points_;
}

std::array<float, 3> MiddleSum::middle() const {
  const double share = points_ == 0 ? 0 : 1 / static_cast<double>(points_);
  std::array<float, 3> middle;
  for (unsigned k = 0; k < 3; ++k) middle[k] = static_cast<float>(sum_[k] * share);
  return middle;
}

std::array<float, 3> middle_of(const Array& positions, std::span<const uint32_t> points) {
  MiddleSum sum;
  for (const uint32_t point : points)
    sum.add(positions.type, positions.bytes.data() + point * positions.tuple_size());
  return sum.middle();
}

}  // namespace maille
