#pragma once

#include <cstdint>

namespace maille {

/// Up to three components of a tuple side by side, in a vector of four lanes (one, if there is one
/// component): compilers make the processor's instructions of it, and where there are none plain loops. Lane
/// by lane the operations are those of IEEE, so that the width of the processor changes no result.
template <unsigned Width>
struct ValueLanes;

template <>
struct ValueLanes<1> {
  using Doubles = double __attribute__((vector_size(8)));
  using Longs = int64_t __attribute__((vector_size(8)));
  using Floats = float __attribute__((vector_size(4)));
  using Ints = int32_t __attribute__((vector_size(4)));
  using Uints = uint32_t __attribute__((vector_size(4)));
};

template <>
struct ValueLanes<4> {
  using Doubles = double __attribute__((vector_size(32)));
  using Longs = int64_t __attribute__((vector_size(32)));
  using Floats = float __attribute__((vector_size(16)));
  using Ints = int32_t __attribute__((vector_size(16)));
  using Uints = uint32_t __attribute__((vector_size(16)));
};

template <class To, class From>
[[gnu::always_inline]] inline To same_bits(const From& from) {
  static_assert(sizeof(To) == sizeof(From));
  To to;
  __builtin_memcpy(&to, &from, sizeof(To));
  return to;
}

}  // namespace maille
