#pragma once

#include <array>
#include <cstdint>

namespace maille {

/// From here on a model moves by 1/127.5 at each visit. Chosen, not swept: part of the format since its
/// beginning; a higher limit is better for sources that do not change, a lower one follows changes sooner.
inline constexpr unsigned adaptation_limit = 126;

/// 65536 / (n + 1.5) for the n-th visit. A product with an error fits 32 bits: the first error is at most
/// 2^15, times 43,690, and all later ones at most 2^16, times 26,214.
inline constexpr auto adaptation_rates = [] {
  std::array<int32_t, adaptation_limit + 1> table{};
  for (unsigned n = 0; n <= adaptation_limit; ++n) table[n] = static_cast<int32_t>(131072 / (2 * n + 3));
  return table;
}();

/// Adaptive probability of one binary decision: moves by 1/(n + 1.5) at the n-th visit, later by 1/(limit
/// + 1.5). The first visits count most (Krichevsky and Trofimov 1981), the limit lets it follow a changing
/// source.
class BitModel {
 public:
  // Inlined by force: it is the inner loop of everything, and keeps the coder's state in registers. Encoder
  // and decoder run these same lines; only coder.code() differs.
  template <class Coder>
  [[gnu::always_inline]] bool code(Coder& coder, bool bit) {
    bit = coder.code(bit, probability_);
    const int32_t target = bit ? highest : lowest;
    const int32_t step = ((target - static_cast<int32_t>(probability_)) * adaptation_rates[visits_]) >> 16;
    probability_ = static_cast<uint16_t>(static_cast<int32_t>(probability_) + step);
    visits_ = static_cast<uint16_t>(visits_ + (visits_ < adaptation_limit));
    return bit;
  }
  uint32_t probability() const { return probability_; }

 private:
  // The floor keeps a decision above 2^-11 bit, which is what bounds a decoder's work per byte.
  static constexpr int32_t lowest = 32;
  static constexpr int32_t highest = 65536 - 32;
  uint16_t probability_ = 32768;
  uint16_t visits_ = 0;
};

/// Number of significant bits: 0 for 0, 64 for the largest.
inline unsigned bit_length(uint64_t value) {
  return value == 0 ? 0 : 64 - static_cast<unsigned>(__builtin_clzll(value));
}

}  // namespace maille
