#pragma once

#include <cstdint>

#include "base/lanes.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace maille {

// Eight numbers of 16 bits that a processor works on at once. What x86 has an instruction for is given by
// it; elsewhere the same is written out.
// Both ways give the same numbers for all inputs, which the codecs that use them rely on: files must not
// depend on the processor. The one sum that does not fit 32 bits is two products of -32768 by itself; it is
// never made, as one factor is always a logit, -2047 to 2047.
using ShortLanes = int16_t __attribute__((vector_size(16)));

/// a[0] * b[0] + a[1] * b[1], and so on.
[[gnu::always_inline]] inline SignedLanes pair_products(ShortLanes a, ShortLanes b) {
#ifdef __SSE2__
  return reinterpret_cast<SignedLanes>(
      _mm_madd_epi16(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
#else
  SignedLanes sums = {};
  for (int i = 0; i < 4; ++i) sums[i] = a[2 * i] * b[2 * i] + a[2 * i + 1] * b[2 * i + 1];
  return sums;
#endif
}

/// a * b >> 16.
[[gnu::always_inline]] inline ShortLanes high_products(ShortLanes a, ShortLanes b) {
#ifdef __SSE2__
  return reinterpret_cast<ShortLanes>(
      _mm_mulhi_epi16(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
#else
  ShortLanes products = {};
  for (int i = 0; i < 8; ++i) products[i] = static_cast<int16_t>(a[i] * b[i] >> 16);
  return products;
#endif
}

/// Sums that end at -32768 and 32767.
[[gnu::always_inline]] inline ShortLanes saturated_sums(ShortLanes a, ShortLanes b) {
#ifdef __SSE2__
  return reinterpret_cast<ShortLanes>(
      _mm_adds_epi16(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
#else
  ShortLanes sums = {};
  for (int i = 0; i < 8; ++i) {
    const int sum = a[i] + b[i];
    sums[i] = static_cast<int16_t>(sum < -32768 ? -32768 : sum > 32767 ? 32767 : sum);
  }
  return sums;
#endif
}

/// Numbers that fit 16 bits, those of `a` first.
[[gnu::always_inline]] inline ShortLanes shortened(SignedLanes a, SignedLanes b) {
#ifdef __SSE2__
  return reinterpret_cast<ShortLanes>(
      _mm_packs_epi32(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
#else
  ShortLanes all = {};
  for (int i = 0; i < 4; ++i) {
    all[i] = static_cast<int16_t>(a[i]);
    all[i + 4] = static_cast<int16_t>(b[i]);
  }
  return all;
#endif
}

}  // namespace maille
