#pragma once

#include <maille/mesh.h>
#include <maille/source.h>

#include <cstdint>
#include <vector>

namespace maille {

/// Least and largest number of each component of an array, as doubles; NaN are counted apart. For `info`, and
/// for queries that rule pieces out. 64-bit integers are rounded to the nearest double.
struct ValueRange {
  struct Component {
    bool any = false;  ///< a number came that is not NaN
    double low = 0, high = 0;
  };
  std::vector<Component> components;  ///< one for all where an array has more than most_ranges
  uint64_t nans = 0;
};
// Above this, one range serves all: a description of thousands of components must not make a table of ranges
// for each piece.
inline constexpr uint32_t most_ranges = 16;

/// Takes in more tuples of the array.
void widen(ValueRange& range, Scalar type, uint32_t components, Bytes tuples);

}  // namespace maille
