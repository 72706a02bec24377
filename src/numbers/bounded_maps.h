#pragma once

#include "numbers/number_map.h"

namespace maille {

/// As choose_maps(), but steps of relative bounds are twice the bound, as all others are: numbers that were
/// decoded may give other maps.
Result<ArrayMaps> choose_maps_once(const Array& array, const Tolerance& tolerance, bool are_positions,
                                   Executor& executor = serial_executor());

}  // namespace maille
