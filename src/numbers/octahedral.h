#pragma once

#include <maille/encode.h>
#include <maille/mesh.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace maille {

/// Unit vectors on a lattice: the sphere is laid onto an octahedron, whose lower half is folded out to make a
/// square (Praun and Hoppe 2003; Meyer et al. 2010). Two codes from -steps to steps stand for three numbers.
struct OctahedralMap {
  int32_t steps = 0;

  /// No component of a decoded unit vector is farther off than this: 1.15 / steps was measured over a million
  /// directions.
  double bound() const { return 1.2 / steps; }

  /// The codes of a unit vector: of the four places round it the one that decodes nearest to it. Of two codes
  /// for the same direction (on the rim of the square) always the same one, so that encoding what was decoded
  /// gives the same codes.
  std::array<int32_t, 2> codes_of(const std::array<double, 3>& vector) const;
  /// The unit vector of any two codes; only + - * /, fabs() and sqrt(), so the same everywhere.
  std::array<double, 3> vector_of(std::array<int32_t, 2> codes) const;
};

/// Codes of 27 bits: sums and differences of a few of them stay within 32. Finer bounds are kept by lattices.
inline constexpr int32_t most_octahedral_steps = 1 << 26;

/// What an array of unit normals is coded with.
struct OctahedralChoice {
  OctahedralMap map;
  double maximum_error = 0;  ///< measured on decoded numbers
  std::vector<uint64_t>
      exceptions;  ///< numbers of vectors that are not of unit length, as tuple * 3 + component, ascending
};

/// A map that keeps `tolerance` for a float array of three components with Role::normal; no value where that
/// is not what the array is, where more than one vector in 64 is not of unit length, or where the bound is
/// too fine.
std::optional<OctahedralChoice> choose_octahedral_map(const Array& array, const Tolerance& tolerance);

}  // namespace maille
