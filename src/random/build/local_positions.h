#pragma once

#include <maille/executor.h>
#include <maille/geometry.h>

#include <vector>

#include "surface/parts/coded_parts.h"

namespace maille {

/// Positions, as the decoder will have them, for building levels of detail: floats around an origin in their
/// midst, so that doubles and integers far from 0 keep their digits. Numbers that are none are 0; those
/// beyond the floats are the last ones.
struct LocalPositions {
  std::vector<float> numbers;  ///< three a point
  Vector3 origin;              ///< 0 for types that floats hold
  double rounding = 0;         ///< no coordinate is farther from origin + number
};

LocalPositions local_positions(const ArrayToCode& positions, Executor& executor);
/// The same around an origin that is known, for a piece of a mesh.
LocalPositions local_positions(const ArrayToCode& positions, const Vector3& origin, Executor& executor);

/// What the box of positions is found by, number by number: finite, and not near the largest doubles.
double usable_number(Scalar type, const std::byte* number);
/// Do positions of this type need no origin?
bool floats_hold(Scalar type);

}  // namespace maille
