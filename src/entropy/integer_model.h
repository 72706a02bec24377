#pragma once

#include <array>
#include <cstdint>

#include "entropy/bit_model.h"

namespace maille {

/// An unsigned number of up to 32 bits, small ones cheap: number of bits in unary, the two bits below the top
/// bit adaptive, the rest raw (after Elias 1975).
class CountModel {
 public:
  template <class Coder>
  uint32_t code(Coder& coder, uint32_t value) {
    const unsigned length = code_length(coder, bit_length(uint64_t{value} + 1));
    uint64_t number = 1;  // value + 1, from its top bit down
    for (unsigned left = length - 1; left > 0; --left) {
      const bool bit = (uint64_t{value} + 1) >> (left - 1) & 1;
      const unsigned done = length - left;
      const bool coded =
          done <= 2 ? mantissa_[length][number & 3].code(coder, bit) : coder.code_raw(bit, 1) != 0;
      number = number << 1 | coded;
    }
    return static_cast<uint32_t>(number - 1);
  }

 private:
  template <class Coder>
  unsigned code_length(Coder& coder, unsigned length) {
    for (unsigned i = 1; i < 33; ++i) {
      if (!longer_[i].code(coder, length > i)) return i;
    }
    return 33;
  }

  std::array<BitModel, 34> longer_;
  std::array<std::array<BitModel, 4>, 34> mantissa_;
};

/// A signed number near 0: zero?, sign, magnitude. One model per context.
class OffsetModel {
 public:
  template <class Coder>
  int32_t code(Coder& coder, int32_t value) {
    if (zero_.code(coder, value == 0)) return 0;
    const bool negative = negative_.code(coder, value < 0);
    const uint32_t size =
        magnitude_[negative].code(coder, static_cast<uint32_t>(negative ? -value : value) - 1);
    const auto magnitude = static_cast<int32_t>(size & 0x3fffffff) + 1;
    return negative ? -magnitude : magnitude;
  }

 private:
  BitModel zero_;
  BitModel negative_;
  std::array<CountModel, 2> magnitude_;
};

}  // namespace maille
