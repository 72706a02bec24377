#pragma once

#include <cstddef>
#include <cstdint>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace maille {

/// Asks for large pages for memory that will be written soon and is not yet: the first touch of small pages
/// can take a quarter of a fast decoder's time. Only a hint.
inline void prefer_large_pages([[maybe_unused]] void* memory, [[maybe_unused]] size_t bytes) {
#if defined(__linux__) && defined(MADV_HUGEPAGE)
  constexpr uintptr_t page = uintptr_t{1} << 21;
  const uintptr_t begin = (reinterpret_cast<uintptr_t>(memory) + page - 1) & ~(page - 1);
  const uintptr_t end = (reinterpret_cast<uintptr_t>(memory) + bytes) & ~(page - 1);
  if (end > begin) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
}

/// For a vector that is about to be filled: room for so many, on large pages.
template <class Vector>
void reserve_on_large_pages(Vector& vector, size_t count) {
  vector.reserve(count);
  prefer_large_pages(vector.data(), count * sizeof(*vector.data()));
}

}  // namespace maille
