#pragma once

#include <cstdint>

namespace maille::testing {

// Sanitizers take ten times as long and look for faults that hardly hide behind one case of many: tests that
// go through many cases, places or elements go through an eighth of them there, and through all without
// sanitizers. With MAILLE_ALL_CASES in the environment (make fuzz): through all everywhere; with
// MAILLE_FEW_CASES: through the eighth everywhere.

/// How many of `count` random cases.
uint64_t cases(uint64_t count);

/// The step over places of a file, where without sanitizers it is `step`. The steps of an eighth are odd
/// where `step` is, so that all remainders come.
uint64_t every(uint64_t step);

/// How many of `count` elements of a mesh that is large only so that much happens: half of them where few
/// cases are gone through, a fourth of an area with two such sides.
uint32_t large(uint32_t count);

}  // namespace maille::testing
