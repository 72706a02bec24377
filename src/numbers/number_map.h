#pragma once

#include <maille/encode.h>
#include <maille/executor.h>
#include <maille/mesh.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/bytes.h"
#include "numbers/octahedral.h"

namespace maille {

/// How the numbers of one component become integers (codes) that lie close where the numbers do, and back. It
/// is the first stage of coding and the last of decoding: predictors and residuals see codes, or numbers
/// through value_of() and nearest_code(), and never the type of the array. docs/format.md, 10.6. Numbers of
/// eight bytes have codes of 64 bits, all others of 32; arithmetic on codes wraps around, so every function
/// here takes any code: a damaged file gives wrong numbers, never undefined behaviour. Whatever turns codes
/// into numbers uses + - * /, floor(), frexp() and ldexp() on doubles only, in a fixed order: both sides must
/// get the same.
struct NumberMap {
  enum class Kind : uint8_t {
    integer,        ///< the bits themselves (integer types)
    ordered,        ///< the bits of a float, reordered so that codes rise with numbers: any float, NaN and -0
                    ///< included
    decimal,        ///< code / 10^exponent, rounded to the type: numbers that were written as text
    binary,         ///< code x 2^exponent
    lattice,        ///< origin + code x step, rounded to the type: the lossy form
    binary_digits,  ///< see ScaledDigits: floats, but none finer than 2^exponent
    decimal_digits,  ///< the same with base 10: numbers that were written with so many significant digits
    logarithm,  ///< zero, and 2^((origin + |code|) x step) with the sign of the code, by FixedLog: the lossy
                ///< form for bounds relative to each number
  };
  static constexpr unsigned kind_count = 8;

  Kind kind = Kind::integer;
  int32_t exponent = 0;
  double origin = 0;
  double step = 0;
  uint32_t digits = 0;
  /// Kinds with digits, for doubles: if not negative, the number becomes a float first and then has so many
  /// decimals, as floats have that were printed by "%f".
  int32_t decimals = -1;
  /// If not 0 (doubles of kinds decimal, binary and with digits, in NumberSpace ordered, too): the number
  /// becomes a float first and then is multiplied by this, as floats are that were turned to other units.
  double factor = 0;
  /// If there are any, codes count these numbers instead, and the kind only says how they are stored: finite
  /// ones in the order of their bits. A coder of codes knows that there are no others.
  std::vector<double> table = {};

  /// Are codes not proportional to their numbers? Then predictions are made among numbers.
  bool is_curved() const;
  /// The number of a code, for predictions; NaN gives 0. Kinds with digits give it before it is rounded to
  /// the type (docs/format.md calls it value(c)), which saves both sides a conversion.
  double value_of(Scalar type, int64_t code) const;
  /// The code of a number nearest to `value`; for linear kinds 0 where no code of 64 bits is near. Predictors
  /// end here: a residual is the true code minus this one.
  int64_t nearest_code(Scalar type, double value) const;
  /// As value_of(), but 0 for infinities, and codes of integers count for themselves.
  double number_near(Scalar type, int64_t code) const;

  /// The code of a number of this type. Exact for lossless kinds when the map was made for it; lattice: the
  /// nearest, 0 for what it does not reach.
  int64_t code_of(Scalar type, const std::byte* number) const;
  /// Lossy kinds: has the number a code of the size that the type has? Infinities and NaN have none.
  bool reaches(Scalar type, const std::byte* number) const;
  /// Writes the number of a code, size_of(type) bytes. Any code is fine.
  void store_number(Scalar type, int64_t code, std::byte* out) const;
  /// The same for `count` codes of 8 bytes for types of 8 bytes, else of 4, taking one code in `stride` and
  /// writing one number in `stride`: a component of interleaved tuples. Codes and numbers may share their
  /// memory where both have the same size, since each number is written after its code was read.
  void store_numbers(Scalar type, const std::byte* codes, std::byte* out, size_t stride, size_t count) const;
};

/// One number as a double; i64 and u64 beyond 2^53 are rounded.
double number_as_double(Scalar type, const std::byte* number);

/// The lossless map that is coarsest where the numbers of one component of an array are: it gives every
/// number back bit for bit, and the mean logarithm of its steps is the largest of those tried
/// (docs/encoder.md, "Maps without loss"). Reads the component several times; integers have kind `integer` at
/// once. No errors: `ordered` holds any float.
NumberMap choose_lossless_map(const Array& array, uint32_t component);

/// 2^(index / 16), the same on every machine: a table of sixteen and ldexp(), as pow() differs among
/// libraries.
double sixteenth_of_octave(int32_t index);

/// Maps for all components of an array; for unit normals with a bound, one map for the tuple.
struct ArrayMaps {
  std::vector<NumberMap> maps;  ///< one per component; octahedral: two of kind integer, for the two codes
  std::optional<OctahedralMap> octahedral;
  bool lossless = true;
  double bound = 0;  ///< largest error promised; 0: lossless
  Tolerance asked;
  double extent = 0;         ///< what a relative bound is a part of
  double maximum_error = 0;  ///< measured on decoded numbers, over finite ones
  double step = 0;
  /// Numbers the lattice does not reach (infinities, NaN, outliers), by tuple * components + component,
  /// ascending.
  std::vector<uint64_t> exceptions;
};

/// A map of kind logarithm for numbers of any size, which keeps each within `part` of itself; none where the
/// type has no numbers as close as that.
std::optional<NumberMap> logarithm_of_any(Scalar type, double part);

/// Chooses maps that keep `tolerance`, with one step for all components. A relative bound is one of the
/// bounding box's diagonal for positions, of the widest component's range for other arrays. Falls back to
/// lossless maps where the bound is finer than what the type can hold. Error: usage, for a bound that is not
/// positive.
Result<ArrayMaps> choose_maps(const Array& array, const Tolerance& tolerance, bool are_positions,
                              Executor& executor = serial_executor());
/// The same, but steps of relative bounds are twice the bound, as all others are: numbers that were decoded
/// may give other maps.
Result<ArrayMaps> choose_maps_once(const Array& array, const Tolerance& tolerance, bool are_positions,
                                   Executor& executor = serial_executor());

}  // namespace maille
