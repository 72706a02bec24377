#pragma once

#include <cstddef>
#include <cstdint>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace maille {

/// For memory that will be written soon and is not yet: large pages where it is large, and all pages at once.
/// Touched one by one they can take a third of a fast decoder's time. Only a hint.
inline void prepare_pages([[maybe_unused]] void* memory, [[maybe_unused]] size_t bytes) {
#if defined(__linux__) && defined(MADV_HUGEPAGE) && defined(MADV_POPULATE_WRITE)
  const auto advise = [&](uintptr_t page, int advice) {
    const uintptr_t begin = (reinterpret_cast<uintptr_t>(memory) + page - 1) & ~(page - 1);
    const uintptr_t end = (reinterpret_cast<uintptr_t>(memory) + bytes) & ~(page - 1);
    if (end > begin) madvise(reinterpret_cast<void*>(begin), end - begin, advice);
  };
  if (bytes < size_t{1} << 20) return;  // not worth two calls
  advise(uintptr_t{1} << 21, MADV_HUGEPAGE);
  advise(uintptr_t{1} << 12, MADV_POPULATE_WRITE);
#endif
}

/// For a vector that is about to be filled.
template <class Vector>
void reserve_pages(Vector& vector, size_t count) {
  vector.reserve(count);
  prepare_pages(vector.data(), count * sizeof(*vector.data()));
}

}  // namespace maille
