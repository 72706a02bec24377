#pragma once

#include <array>
#include <cstdint>

#include "entropy/bit_model.h"
#include "entropy/symbol_model.h"

namespace maille {

/// An unsigned number of up to 32 bits: below 15 one symbol; from there the number of bits in unary, then the
/// bits, raw (after Elias 1975).
class CountModel {
 public:
  template <class Coder>
  uint32_t code(Coder& coder, uint32_t value) {
    const unsigned symbol = small_.code(coder, value < escape ? value : escape);
    if (symbol < escape) return symbol;
    const unsigned length = code_length(coder, bit_length(uint64_t{value} + 1 - escape));
    const uint64_t below_top = uint64_t{value} + 1 - escape - (uint64_t{1} << (length - 1));
    const uint64_t number =
        (uint64_t{1} << (length - 1)) + coder.code_raw(static_cast<uint32_t>(below_top), length - 1);
    return static_cast<uint32_t>(number - 1 + escape);
  }

  /// That of small numbers.
  SymbolModel& small() { return small_; }

 private:
  static constexpr unsigned escape = 15;

  /// A number of 32 bits, plus 1, has 33 at most, so 32 decisions say all; damaged bytes cannot make more.
  template <class Coder>
  unsigned code_length(Coder& coder, unsigned length) {
    for (unsigned i = 1; i < 33; ++i) {
      if (!longer_[i].code(coder, length > i)) return i;
    }
    return 33;
  }

  SymbolModel small_;
  std::array<BitModel, 34> longer_;
};

/// A signed number near 0: from -7 to 7 one symbol, others escaped. For decoders any bytes give a number
/// below 2^30 + 8 in size; an encoder must not be given larger ones.
class OffsetModel {
 public:
  template <class Coder>
  [[gnu::always_inline]] int32_t code(Coder& coder, int32_t value) {
    const unsigned symbol =
        small_.code(coder, value >= -7 && value <= 7 ? static_cast<unsigned>(value + 7) : escape);
    return symbol < escape ? static_cast<int32_t>(symbol) - 7 : code_large(coder, value);
  }

 private:
  static constexpr unsigned escape = 15;

  template <class Coder>
  int32_t code_large(Coder& coder, int32_t value) {
    const bool negative = negative_.code(coder, value < 0);
    const auto size = static_cast<uint32_t>(negative ? -value : value) - 8;
    const auto magnitude = static_cast<int32_t>(magnitude_.code(coder, size) & 0x3fffffff) + 8;
    return negative ? -magnitude : magnitude;
  }

  SymbolModel small_;
  BitModel negative_;
  CountModel magnitude_;
};

}  // namespace maille
