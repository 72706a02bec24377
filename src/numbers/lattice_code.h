#pragma once

#include <cmath>
#include <cstdint>

namespace maille {

/// The number of the lattice point nearest to `value`; 0 where no code of 64 bits is near (9.0e18 is the last
/// round number below 2^63, from which on the cast would be undefined), and for NaN, since it compares false.
inline int64_t lattice_code(double value, double origin, double step) {
  const double code = std::floor((value - origin) / step + 0.5);
  return std::fabs(code) < 9.0e18 ? static_cast<int64_t>(code) : 0;
}

}  // namespace maille
