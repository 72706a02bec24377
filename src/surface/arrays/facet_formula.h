#pragma once

#include <array>
#include <cstdint>

#include "surface/vector3.h"

namespace maille {

/// How a program computes the normal of a triangle: the cross product of two edges over its length. The last
/// bits, and the signs of zeros, depend on how each step is rounded and on which way edges are subtracted;
/// seven bits tell them all apart. Normals that a formula gives take 0.01 to 0.6 bits in doubles, 0.3 to 1.2
/// in floats (a6ba7ce). docs/format.md, 13.6.
struct FacetFormula {
  static constexpr unsigned count = 128;

  uint8_t bits = 0;

  bool cross_in_float() const { return (bits & 1) != 0; }
  bool length_in_float() const { return (bits & 2) != 0; }
  bool reciprocal() const { return (bits & 4) != 0; }      ///< times 1 / length, not over it
  bool first_reversed() const { return (bits & 8) != 0; }  ///< a - b for b - a
  bool second_reversed() const { return (bits & 16) != 0; }
  bool swapped() const { return (bits & 32) != 0; }  ///< the second edge times the first
  bool negated() const { return (bits & 64) != 0; }
  /// Do normals point away from the side where corners turn to the left?
  bool inward() const { return first_reversed() ^ second_reversed() ^ swapped() ^ negated(); }

  /// The normal from the edges at the first of three corners; 0 where there is none.
  Vector3 normal(const Vector3& a, const Vector3& b, const Vector3& c) const;
};

}  // namespace maille
