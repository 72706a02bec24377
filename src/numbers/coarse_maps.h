#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <optional>
#include <span>

#include "numbers/number_map.h"

namespace maille {

/// What find_coarse_map() found, and what it is worth against the exact map alone.
struct CoarseMap {
  NumberMap map;
  int64_t saving = 0;  ///< in 1/1024 bits, of all numbers
};

/// A map whose numbers lie near those of one component of doubles, with so few codes that what is left
/// (RefinedMaps) costs less than is saved. `exact` is the lossless map of the component. `source`: as for
/// with_tables(). None where nothing is saved, for fewer than 64 numbers, and where one is not finite or
/// beyond 10^30 or all are below 10^-30. The same on every machine: doubles in a fixed order, logarithms in
/// integers.
std::optional<CoarseMap> find_coarse_map(const Array& array, uint32_t component, const NumberMap& exact,
                                         std::span<const uint32_t> source);

}  // namespace maille
