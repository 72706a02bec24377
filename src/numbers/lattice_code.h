#pragma once

#include <cmath>
#include <cstdint>

namespace maille {

/// The number of the lattice point nearest to `value`; 0 where no code of 64 bits is near.
inline int64_t lattice_code(double value, double origin, double step) {
  const double code = std::floor((value - origin) / step + 0.5);
  return std::fabs(code) < 9.0e18 ? static_cast<int64_t>(code) : 0;
}

}  // namespace maille
