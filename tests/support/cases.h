#pragma once

#include <cstdint>

namespace maille::testing {

/// How many of `count` random cases a test goes through: all; under sanitizers, which take ten times as long
/// and look for faults that hardly hide behind one case, a quarter. With MAILLE_ALL_CASES in the environment
/// (make fuzz): all.
uint64_t cases(uint64_t count);

}  // namespace maille::testing
