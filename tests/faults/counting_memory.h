#pragma once

#include <cstddef>
#include <cstdint>

// Programs that link counting_memory.cpp have an operator new that counts, and fails when it is told to.

namespace maille::testing {

struct Memory {
  uint64_t live = 0;         ///< bytes
  uint64_t most = 0;         ///< the highest `live` since watch_memory()
  uint64_t blocks = 0;       ///< live
  uint64_t allocations = 0;  ///< since watch_memory()
};

/// Counts anew from here on, in this thread as in others.
void watch_memory();
Memory memory();

/// The allocation of this number after watch_memory(), from 1 on, throws std::bad_alloc; `and_all_others`: so
/// do those after it. 0: none does.
void fail_allocation(uint64_t number, bool and_all_others = false);

}  // namespace maille::testing
