#pragma once

#include <cstdint>
#include <vector>

#include "entropy/bit_model.h"

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

/// Signed residuals of up to `Bits` bits: number of significant bits from the expected one up or down, sign,
/// then the bits below the top one. The first `mantissa_bits` of those have a model each for all bits before
/// them, so that a few frequent values are learnt as such (machine parts, voxel lattices); the rest is raw.
template <unsigned Bits>
class ResidualModel {
 public:
  explicit ResidualModel(unsigned mantissa_bits)
      : mantissa_bits_(mantissa_bits),
        length_(components * context_count * lengths),
        sign_(components * 4),
        mantissa_(components * lengths << mantissa_bits) {}

  template <class Coder>
  int64_t code(Coder& coder, int64_t residual, const ResidualContext& context) {
    const auto unsigned_residual = static_cast<uint64_t>(residual);
    const unsigned component = context.component < components ? context.component : components - 1;
    const uint64_t size = residual < 0 ? -unsigned_residual : unsigned_residual;
    const unsigned length = code_length(coder, bit_length(size), component, context);
    if (length == 0) return 0;
    const bool negative = sign_[component * 4 + context.surprise].code(coder, residual < 0);
    const uint64_t coded = code_mantissa(coder, size, length, component);
    return static_cast<int64_t>(negative ? -coded : coded);
  }

 private:
  static constexpr unsigned components = 3;
  static constexpr unsigned expected_classes = 20;
  static constexpr unsigned spread_classes = 12;
  static constexpr unsigned context_count = expected_classes * spread_classes * 4;
  static constexpr unsigned lengths = Bits + 1;

  template <class Coder>
  unsigned code_length(Coder& coder, unsigned length, unsigned component, const ResidualContext& context) {
    const unsigned expected = context.expected / 2;
    const unsigned expected_class = expected < expected_classes ? expected : expected_classes - 1;
    const unsigned row =
        ((component * expected_classes + expected_class) * spread_classes + context.spread) * 4 +
        context.surprise;
    BitModel* longer = &length_[row * lengths];  // longer[i]: is the length above i?
    unsigned i = expected / 2 < Bits ? expected / 2 : Bits - 1;
    if (longer[i].code(coder, length > i)) {
      while (++i < Bits && longer[i].code(coder, length > i)) {
      }
      return i;
    }
    while (i > 0 && !longer[i - 1].code(coder, length > i - 1)) --i;
    return i;
  }

  template <class Coder>
  uint64_t code_mantissa(Coder& coder, uint64_t size, unsigned length, unsigned component) {
    BitModel* tree = &mantissa_[(component * lengths + length) << mantissa_bits_];
    unsigned left = length - 1;
    uint64_t value = 1;
    for (unsigned modelled = left < mantissa_bits_ ? left : mantissa_bits_; modelled > 0; --modelled) {
      --left;
      value = value << 1 | static_cast<uint64_t>(tree[value].code(coder, size >> left & 1));
    }
    while (left > 0) {
      const unsigned raw = left < 32 ? left : 32;
      left -= raw;
      const auto bits = static_cast<uint32_t>(size >> left & ((uint64_t{1} << raw) - 1));
      value = value << raw | coder.code_raw(bits, raw);
    }
    return value;
  }

  unsigned mantissa_bits_;
  std::vector<BitModel> length_;
  std::vector<BitModel> sign_;
  std::vector<BitModel> mantissa_;
};

}  // namespace maille
