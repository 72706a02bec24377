#pragma once

#include <cstddef>
#include <cstdint>
#include <new>

#include "base/unfilled.h"

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace maille {

/// Large pages have 2 MiB on x86 and on most ARM systems. Where they have another size, the advice below is
/// worth less but never wrong.
inline constexpr size_t large_page = size_t{1} << 21;

/// Advises only for pages that lie wholly in this memory, since others contain neighbours.
inline void advise_pages([[maybe_unused]] void* memory, [[maybe_unused]] size_t bytes,
                         [[maybe_unused]] size_t page, [[maybe_unused]] int advice) {
#ifdef __linux__
  const uintptr_t begin = (reinterpret_cast<uintptr_t>(memory) + page - 1) & ~(page - 1);
  const uintptr_t end = (reinterpret_cast<uintptr_t>(memory) + bytes) & ~(page - 1);
  if (end > begin) madvise(reinterpret_cast<void*>(begin), end - begin, advice);
#endif
}

/// For memory that will be written soon and is not yet: large pages where it is large, and all pages at once.
/// Touched one by one they can take a third of a fast decoder's time. Only a hint.
inline void prepare_pages([[maybe_unused]] void* memory, [[maybe_unused]] size_t bytes) {
#if defined(__linux__) && defined(MADV_HUGEPAGE) && defined(MADV_POPULATE_WRITE)
  if (bytes < size_t{1} << 20) return;  // not worth two calls
  advise_pages(memory, bytes, large_page, MADV_HUGEPAGE);
  advise_pages(memory, bytes, size_t{1} << 12, MADV_POPULATE_WRITE);
#endif
}

/// Gives the large pages that lie wholly in this memory back to the system. Their contents may be lost, so it
/// is for memory that will be written before it is read again.
inline void drop_pages([[maybe_unused]] void* memory, [[maybe_unused]] size_t bytes) {
#ifdef __linux__
  advise_pages(memory, bytes, large_page, MADV_DONTNEED);
#endif
}

/// For a vector that is about to be filled.
template <class Vector>
void reserve_pages(Vector& vector, size_t count) {
  vector.reserve(count);
  prepare_pages(vector.data(), count * sizeof(*vector.data()));
}

/// Memory of a decoder while it works. From least_scratch bytes on it is in large pages of its own: one of
/// them takes as long as 45 small ones on a virtual machine (50 us and 1.1 us each).
template <class T>
struct ScratchAllocator : UnfilledAllocator<T> {
  template <class U>
  struct rebind {
    using other = ScratchAllocator<U>;
  };
#if defined(__linux__) && defined(MADV_HUGEPAGE)
  // An eighth of a large page. Smaller arrays would waste most of one.
  static constexpr size_t least_scratch = size_t{1} << 18;
  T* allocate(size_t count) {
    if (count * sizeof(T) < least_scratch) return std::allocator<T>::allocate(count);
    const size_t bytes = (count * sizeof(T) + large_page - 1) & ~(large_page - 1);
    void* const memory = ::operator new(bytes, std::align_val_t(large_page));
    advise_pages(memory, bytes, large_page, MADV_HUGEPAGE);
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, size_t count) {
    if (count * sizeof(T) < least_scratch) return std::allocator<T>::deallocate(memory, count);
    ::operator delete(memory, std::align_val_t(large_page));
  }
#endif
};
template <class T>
using Scratch = std::vector<T, ScratchAllocator<T>>;

}  // namespace maille
