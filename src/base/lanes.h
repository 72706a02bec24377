#pragma once

#include <cstdint>

namespace maille {

/// Four numbers that a processor works on at once. Sums of integers wrap around. Vectors of gcc and clang, 16
/// bytes as SSE2, NEON and WebAssembly have them, so the same source gives the same numbers everywhere.
using Lanes = uint32_t __attribute__((vector_size(16)));
using SignedLanes = int32_t __attribute__((vector_size(16)));
using FloatLanes = float __attribute__((vector_size(16)));

template <class Vector>
[[gnu::always_inline]] inline Vector clamp_lanes(Vector x, Vector low, Vector high) {
  const Vector raised = x > low ? x : low;
  return raised < high ? raised : high;
}

}  // namespace maille
