#pragma once

#include <cstdint>
#include <type_traits>

namespace maille {

/// Which known elements a number is predicted from. The encoder tries them on the array and keeps the best.
enum class Predictor : uint8_t {
  previous,      ///< the element coded before
  neighbour,     ///< an element next to it
  nearest_gate,  ///< the parallelogram with the smallest past errors: exact on lattices and flat parts
  two_gates,     ///< the mean of the two best
  all_gates,     ///< the mean of all parallelograms
};
inline constexpr unsigned predictor_count = 5;

/// Arithmetic on codes that wraps around, so that predictions from any codes are defined.
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
