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

/// sum / count, rounded to the nearest, halves away from zero; count is 2 to 5. Sums of 32 bits need no
/// division: the error of the inverse, 3 x 2^-33 at most, is too small to reach the next whole number.
inline int32_t mean_of(int32_t sum, unsigned count) {
  constexpr uint64_t inverse[] = {0, 0, uint64_t{1} << 32, 0xaaaaaaab, uint64_t{1} << 31, 0x66666667};
  const uint64_t size =
      (sum < 0 ? uint64_t{0} - static_cast<uint64_t>(int64_t{sum}) : static_cast<uint64_t>(sum)) + count / 2;
  const auto mean = static_cast<int32_t>(size * inverse[count] >> 33);
  return sum < 0 ? -mean : mean;
}
inline int64_t mean_of(int64_t sum, unsigned count) {
  const uint64_t size = (sum < 0 ? -static_cast<uint64_t>(sum) : static_cast<uint64_t>(sum)) + count / 2;
  const auto mean = static_cast<int64_t>(size / count);
  return sum < 0 ? -mean : mean;
}

/// a + b - across: the fourth corner of the parallelogram on the edge ab (Touma and Gotsman 1998).
template <class Code>
Code parallelogram(Code a, Code b, Code across) {
  return wrapped_sum(a, wrapped_difference(b, across));
}

}  // namespace maille
