#include "numbers/point_position.h"

#include "numbers/number_map.h"

namespace maille {

Vector3 point_position(Scalar type, const std::byte* positions, uint64_t point) {
  const size_t size = size_of(type);
  Vector3 position;
  for (unsigned k = 0; k < 3; ++k) position[k] = number_as_double(type, positions + (3 * point + k) * size);
  return position;
}

}  // namespace maille
