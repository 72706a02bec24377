#pragma once

#include <cstdint>
#include <vector>

#include "entropy/bit_model.h"
#include "entropy/symbol_model.h"

namespace maille {

/// Size of a residual in half octaves: 0, 1, 2, 3, then two to the octave.
inline unsigned half_octaves(uint64_t size) {
  if (size < 2) return static_cast<unsigned>(size);
  const unsigned length = bit_length(size);
  return 2 * length - 2 + static_cast<unsigned>(size >> (length - 2) & 1);
}

/// What is known about a residual before it is coded.
struct ResidualContext {
  unsigned component = 0;  ///< 0 to 2; further components share the last
  unsigned expected = 0;   ///< size expected from neighbours, in half octaves
  unsigned spread = 0;     ///< how far two predictions lie apart, 0 to 10; 11: there was only one
  unsigned surprise = 0;   ///< previous component: 0 none, 1 smaller than expected, 2 as expected, 3 larger
};

/// Signed residuals of up to `Bits` bits: the number of significant bits, in the context of what was
/// expected; then sign and the first bits below the top one as one symbol; the rest raw. With `whole_values`
/// eight bits more have models, each in the context of all before it, so that a few frequent values are
/// learnt as such (machine parts, voxel lattices).
template <unsigned Bits>
class ResidualModel {
 public:
  explicit ResidualModel(bool whole_values)
      : whole_values_(whole_values),
        length_(components * context_count),
        head_(components * (Bits + 1)),
        tail_(whole_values ? components * (Bits + 1) : 0) {}

  template <class Coder>
  [[gnu::always_inline]] int64_t code(Coder& coder, int64_t residual, const ResidualContext& context) {
    const auto bits = static_cast<uint64_t>(residual);
    const uint64_t size = residual < 0 ? -bits : bits;
    const unsigned component = context.component < components ? context.component : components - 1;
    const unsigned length = code_length(coder, bit_length(size), component, context);
    if (length == 0) return 0;
    // Sign and up to three bits below the top one.
    const unsigned head_bits = length < 4 ? length - 1 : 3;
    unsigned left = length - 1 - head_bits;
    const auto first = static_cast<unsigned>(size >> left & ((1u << head_bits) - 1));
    const unsigned head =
        head_[component * (Bits + 1) + length].code(coder, (residual < 0 ? 1u << head_bits : 0u) | first);
    // A damaged stream can hold symbols that the encoder does not use.
    const bool negative = (head >> head_bits & 1) != 0;
    uint64_t value = uint64_t{1} << head_bits | (head & ((1u << head_bits) - 1));
    if (whole_values_) value = code_tail(coder, size, value, left, component * (Bits + 1) + length, head);
    while (left > 0) {
      const unsigned raw = left < 32 ? left : 32;
      left -= raw;
      value = value << raw |
              coder.code_raw(static_cast<uint32_t>(size >> left & ((uint64_t{1} << raw) - 1)), raw);
    }
    return static_cast<int64_t>(negative ? -value : value);
  }

 private:
  static constexpr unsigned components = 3;
  static constexpr unsigned expected_classes = 20;
  static constexpr unsigned spread_classes = 12;
  static constexpr unsigned context_count = expected_classes * spread_classes * 4;
  static constexpr unsigned tail_models = 16 + 256;
  static constexpr unsigned escape = 15;

  /// Lengths from a little below the expected one are symbols; others are escaped and raw.
  template <class Coder>
  [[gnu::always_inline]] unsigned code_length(Coder& coder, unsigned length, unsigned component,
                                              const ResidualContext& context) {
    const unsigned half = context.expected / 2;
    const unsigned expected_class = half < expected_classes ? half : expected_classes - 1;
    SymbolModel& model =
        length_[((component * expected_classes + expected_class) * spread_classes + context.spread) * 4 +
                context.surprise];
    const unsigned expected = context.expected / 2;
    const unsigned base = expected > 7 ? expected - 7 : 0;
    unsigned symbol = length - base < escape ? length - base : escape;
    symbol = model.code(coder, symbol);
    if (symbol == escape) {
      length = coder.code_raw(length, 7);
      return length <= Bits ? length : Bits;
    }
    return base + symbol < Bits ? base + symbol : Bits;
  }

  template <class Coder>
  uint64_t code_tail(Coder& coder, uint64_t size, uint64_t value, unsigned& left, unsigned row,
                     unsigned head) {
    std::vector<SymbolModel>& models = tail_[row];
    if (models.empty()) models.resize(tail_models);
    unsigned node = head;
    for (unsigned first = 0; first <= 16 && left > 0; first += 16) {
      const unsigned bits = left < 4 ? left : 4;
      left -= bits;
      const unsigned mask = (1u << bits) - 1;
      const unsigned symbol =
          models[first + node].code(coder, static_cast<unsigned>(size >> left & mask)) & mask;
      value = value << bits | symbol;
      node = node << 4 | symbol;
    }
    return value;
  }

  bool whole_values_;
  std::vector<SymbolModel> length_;
  std::vector<SymbolModel> head_;
  std::vector<std::vector<SymbolModel>> tail_;  // by component and length; made when met, since few are
};

}  // namespace maille
