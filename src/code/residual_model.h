#pragma once

#include <cstdint>
#include <vector>

#include "entropy/bit_model.h"
#include "entropy/symbol_model.h"

namespace maille {

/// Size of a residual in half octaves: 0, 1, 2, 3, then two to the octave. At most 127, for 64 bits.
inline unsigned half_octaves(uint64_t size) {
  if (size < 2) return static_cast<unsigned>(size);
  const unsigned length = bit_length(size);
  return 2 * length - 2 + static_cast<unsigned>(size >> (length - 2) & 1);
}

/// What is known about a residual before it is coded.
struct ResidualContext {
  unsigned expected = 0;  ///< size expected from neighbours, in half octaves
  unsigned spread = 0;    ///< how far two predictions lie apart, 0 to 10; 11: there was only one
};

/// Signed residuals of up to `Bits` bits: the number of significant bits, in the context of what was
/// expected; then sign and the first bits below the top one as one symbol; the rest raw. The stages are apart
/// so that the components of a tuple can take them side by side, each in its lane. docs/format.md, 13.4.
///
/// Bits below the first four are raw: within an eighth of an octave a distribution of residuals is nearly
/// even.
template <unsigned Bits>
class ResidualModel {
 public:
  static constexpr unsigned components =
      3;  ///< with models of their own; further ones share those of the last

  /// `of`: how many components there are, not above `components`.
  explicit ResidualModel(unsigned of = components)
      : length_(of * expected_classes * spread_classes), head_(of * (Bits + 1)) {}

  /// Lengths from a little below the expected one are symbols; others are escaped and raw. Fifteen lengths
  /// from seven octaves below what was expected on: a residual is seldom longer than seven octaves above, and
  /// then seven raw bits hardly matter. What is read is at most `Bits`, so that tables and shifts stay in
  /// range.
  template <class Coder>
  [[gnu::always_inline]] unsigned code_length(Coder& coder, unsigned length, unsigned component,
                                              const ResidualContext& context, unsigned lane) {
    const unsigned octaves = context.expected / 2;
    const unsigned expected_class = octaves < expected_classes ? octaves : expected_classes - 1;
    SymbolModel& model =
        length_[(component * expected_classes + expected_class) * spread_classes + context.spread];
    const unsigned base = octaves > 7 ? octaves - 7 : 0;
    const unsigned symbol = model.code(coder, length - base < escape ? length - base : escape, lane);
    length = symbol < escape ? base + symbol : coder.code_raw(length, 7, lane);
    return length < Bits ? length : Bits;
  }

  /// The residual itself, given the number of its significant bits.
  template <class Coder>
  [[gnu::always_inline]] int64_t code_value(Coder& coder, int64_t residual, unsigned length,
                                            unsigned component, unsigned lane) {
    if (length == 0) return 0;
    const auto bits = static_cast<uint64_t>(residual);
    const uint64_t size = residual < 0 ? -bits : bits;
    const unsigned row = component * (Bits + 1) + length;
    // Sign and up to three bits below the top one.
    const unsigned head_bits = length < 4 ? length - 1 : 3;
    unsigned left = length - 1 - head_bits;
    const auto first = static_cast<unsigned>(size >> left & ((1u << head_bits) - 1));
    const unsigned head = head_[row].code(coder, (residual < 0 ? 1u << head_bits : 0u) | first, lane);
    // A damaged stream can hold symbols that the encoder does not use: bits beyond the sign fall away.
    const bool negative = (head >> head_bits & 1) != 0;
    uint64_t value = uint64_t{1} << head_bits | (head & ((1u << head_bits) - 1));
    if constexpr (Bits > 32) {
      if (left > 32) {
        left -= 32;
        value = value << 32 | coder.code_raw(static_cast<uint32_t>(size >> left), 32, lane);
      }
    }
    const auto rest = static_cast<uint32_t>(size & ((uint64_t{1} << left) - 1));
    value = value << left | coder.code_raw(rest, left, lane);
    return static_cast<int64_t>(negative ? -value : value);
  }

 private:
  // Octaves: expected sizes of 2^19 and more are one class. Spreads: 0 to 10, and 11 for none.
  static constexpr unsigned expected_classes = 20;
  static constexpr unsigned spread_classes = 12;
  static constexpr unsigned escape = 15;

  std::vector<SymbolModel> length_;
  std::vector<SymbolModel> head_;
};

}  // namespace maille
