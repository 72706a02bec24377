#pragma once

#include <array>
#include <cstdint>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace maille {

/// Where a distribution would be with one symbol only: every other keeps one part in 2^15.
struct alignas(16) SymbolTarget : std::array<int16_t, 16> {};
inline constexpr auto symbol_targets = [] {
  std::array<SymbolTarget, 16> targets{};
  for (unsigned symbol = 0; symbol < 16; ++symbol) {
    for (unsigned i = 0; i < 16; ++i) {
      targets[symbol][i] = static_cast<int16_t>(i <= symbol ? i : 32768 - 16 + i);
    }
  }
  return targets;
}();

/// The n-th visit moves the distribution by 2^-rate: the first visits count most, later the window is about
/// 2^7 visits. (1 / (n + 1.5) rounded to powers of two, which shifts can do for sixteen numbers at once.)
inline constexpr auto symbol_rates = [] {
  std::array<uint8_t, 192> rates{};
  for (unsigned n = 0; n < rates.size(); ++n) {
    rates[n] = n < 1 ? 1 : n < 3 ? 2 : n < 7 ? 3 : n < 16 ? 4 : n < 48 ? 5 : n < 191 ? 6 : 7;
  }
  return rates;
}();

/// Adaptive distribution over 16 symbols: cumulative frequencies over 2^15 that move towards the coded symbol
/// by a power of two, all at once (after Giesen's description of LZNA, 2015).
///
/// No frequency becomes 0, which a coder could not write: targets of neighbours are at least 1 apart, and a
/// shift that rounds down takes at most d - 1 from a distance of d. All of it fits 16 bits with sign.
///
/// Half the symbols of binary decisions per residual: turbineblade decoded 1.5 times as fast, 0.8 % larger
/// (d0a3f46).
class SymbolModel {
 public:
  SymbolModel() {
    for (unsigned i = 0; i < 16; ++i) cumulative_[i] = static_cast<int16_t>(i * 2048);
  }

  template <class Coder>
  [[gnu::always_inline]] unsigned code(Coder& coder, unsigned symbol, unsigned lane = 0) {
    if constexpr (Coder::encoding) {
      coder.put(start(symbol), frequency(symbol), 15, lane);
    } else {
      symbol = find(static_cast<int16_t>(coder.peek(15, lane)));
      coder.advance(start(symbol), frequency(symbol), 15, lane);
    }
    adapt(symbol);
    return symbol;
  }

 private:
  static constexpr int highest = 32768;

  uint32_t start(unsigned symbol) const { return static_cast<uint32_t>(cumulative_[symbol]); }

  uint32_t frequency(unsigned symbol) const {
    const int end = symbol == 15 ? highest : cumulative_[symbol + 1];
    return static_cast<uint32_t>(end - cumulative_[symbol]);
  }

#ifdef __SSE2__
  // The plain loops below in two registers of eight numbers; compilers do not get there by themselves.
  [[gnu::always_inline]] unsigned find(int16_t slot) const {
    const __m128i slots = _mm_set1_epi16(slot);
    const __m128i above = _mm_packs_epi16(_mm_cmpgt_epi16(half(0), slots), _mm_cmpgt_epi16(half(1), slots));
    return static_cast<unsigned>(__builtin_ctz(static_cast<unsigned>(_mm_movemask_epi8(above)) | 0x10000)) -
           1;
  }
  [[gnu::always_inline]] void adapt(unsigned symbol) {
    const auto* target = reinterpret_cast<const __m128i*>(symbol_targets[symbol].data());
    const __m128i rate = _mm_cvtsi32_si128(symbol_rates[visits_]);
    for (unsigned i = 0; i < 2; ++i) {
      const __m128i step = _mm_sra_epi16(_mm_sub_epi16(_mm_load_si128(target + i), half(i)), rate);
      _mm_store_si128(reinterpret_cast<__m128i*>(cumulative_.data()) + i, _mm_add_epi16(half(i), step));
    }
    visits_ = static_cast<uint16_t>(visits_ + (visits_ < symbol_rates.size() - 1));
  }
  [[gnu::always_inline]] __m128i half(unsigned i) const {
    return _mm_load_si128(reinterpret_cast<const __m128i*>(cumulative_.data()) + i);
  }
#else
  unsigned find(int16_t slot) const {
    unsigned symbol = 15;
    while (cumulative_[symbol] > slot) --symbol;
    return symbol;
  }
  void adapt(unsigned symbol) {
    const std::array<int16_t, 16>& target = symbol_targets[symbol];
    const int rate = symbol_rates[visits_];
    for (unsigned i = 0; i < 16; ++i) {
      cumulative_[i] = static_cast<int16_t>(cumulative_[i] + ((target[i] - cumulative_[i]) >> rate));
    }
    visits_ = static_cast<uint16_t>(visits_ + (visits_ < symbol_rates.size() - 1));
  }
#endif

  alignas(16) std::array<int16_t, 16> cumulative_;
  uint16_t visits_ = 0;  // not of a type that may alias the coder's state
};

}  // namespace maille
