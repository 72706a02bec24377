#pragma once

#include <cstdint>
#include <type_traits>

namespace maille {

/// Arithmetic on codes that wraps around, so that predictions from any codes are defined: those of a damaged
/// file, and of maps whose codes use all of their bits. What an encoder subtracts a decoder adds, and gets
/// the same code.
template <class Code>
Code wrapped_sum(Code a, Code b) {
  using Unsigned = std::make_unsigned_t<Code>;
  return static_cast<Code>(static_cast<Unsigned>(a) + static_cast<Unsigned>(b));
}
template <class Code>
Code wrapped_difference(Code a, Code b) {
  using Unsigned = std::make_unsigned_t<Code>;
  return static_cast<Code>(static_cast<Unsigned>(a) - static_cast<Unsigned>(b));
}

/// a + b - across: the fourth corner of the parallelogram on the edge ab (Touma and Gotsman 1998).
template <class Code>
Code parallelogram(Code a, Code b, Code across) {
  return wrapped_sum(a, wrapped_difference(b, across));
}

}  // namespace maille
