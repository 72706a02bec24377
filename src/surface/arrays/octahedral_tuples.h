#pragma once

#include <array>

#include "base/bytes.h"
#include "numbers/number_maps.h"
#include "numbers/octahedral.h"

namespace maille {

/// The codes of a tuple of three floats or doubles.
inline std::array<int32_t, 2> codes_of_tuple(const OctahedralMap& map, Scalar type, const std::byte* tuple) {
  std::array<double, 3> vector;
  for (size_t k = 0; k < 3; ++k) vector[k] = number_as_double(type, tuple + k * size_of(type));
  return map.codes_of(vector);
}

/// The inverse. Vectors of any codes are finite, so damaged bytes only give other vectors.
inline void store_tuple(const OctahedralMap& map, const std::array<int32_t, 2>& codes, Scalar type,
                        std::byte* tuple) {
  const auto vector = map.vector_of(codes);
  for (size_t k = 0; k < 3; ++k) {
    std::byte* const number = tuple + k * size_of(type);
    if (type == Scalar::f32) {
      store(number, static_cast<float>(vector[k]));
    } else {
      store(number, vector[k]);
    }
  }
}

}  // namespace maille
