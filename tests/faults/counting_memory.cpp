#include "faults/counting_memory.h"

#include <malloc.h>
#include <atomic>
#include <cstdlib>
#include <new>

namespace maille::testing {
namespace {

std::atomic<uint64_t> live, most, blocks, allocations, failing;
std::atomic<bool> all_others;

void* counted(void* block) {
  if (block == nullptr) throw std::bad_alloc();
  const uint64_t now = live += malloc_usable_size(block);
  ++blocks;
  uint64_t before = most;
  while (now > before && !most.compare_exchange_weak(before, now)) {
  }
  return block;
}

void may_fail() {
  const uint64_t number = ++allocations, at = failing;
  if (at != 0 && (number == at || (number > at && all_others))) throw std::bad_alloc();
}

void* allocate(size_t size) {
  may_fail();
  return counted(std::malloc(size == 0 ? 1 : size));
}
void* allocate(size_t size, size_t alignment) {
  may_fail();
  return counted(std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment));
}
void* allocate_or_null(size_t size) noexcept try { return allocate(size); } catch (const std::bad_alloc&) {
  return nullptr;
}
void release(void* block) {
  if (block == nullptr) return;
  live -= malloc_usable_size(block);
  --blocks;
  std::free(block);
}

}  // namespace

void watch_memory() {
  failing = 0;
  allocations = 0;
  most = live.load();
}

Memory memory() {
  return {live, most, blocks, allocations};
}

void fail_allocation(uint64_t number, bool and_all_others) {
  all_others = and_all_others;
  failing = number;
}

}  // namespace maille::testing

// All forms are replaced. The standard library's own forms for arrays and for nothrow call the plain ones,
// but those of AddressSanitizer's runtime do not: memory taken there and given back here would stop the
// program.
void* operator new(size_t size) {
  return maille::testing::allocate(size);
}
void* operator new[](size_t size) {
  return maille::testing::allocate(size);
}
void* operator new(size_t size, const std::nothrow_t&) noexcept {
  return maille::testing::allocate_or_null(size);
}
void* operator new[](size_t size, const std::nothrow_t&) noexcept {
  return maille::testing::allocate_or_null(size);
}
void* operator new(size_t size, std::align_val_t alignment) {
  return maille::testing::allocate(size, static_cast<size_t>(alignment));
}
void* operator new[](size_t size, std::align_val_t alignment) {
  return maille::testing::allocate(size, static_cast<size_t>(alignment));
}
void operator delete(void* block) noexcept {
  maille::testing::release(block);
}
void operator delete[](void* block) noexcept {
  maille::testing::release(block);
}
void operator delete(void* block, size_t) noexcept {
  maille::testing::release(block);
}
void operator delete[](void* block, size_t) noexcept {
  maille::testing::release(block);
}
void operator delete(void* block, const std::nothrow_t&) noexcept {
  maille::testing::release(block);
}
void operator delete[](void* block, const std::nothrow_t&) noexcept {
  maille::testing::release(block);
}
void operator delete(void* block, std::align_val_t) noexcept {
  maille::testing::release(block);
}
void operator delete[](void* block, std::align_val_t) noexcept {
  maille::testing::release(block);
}
void operator delete(void* block, size_t, std::align_val_t) noexcept {
  maille::testing::release(block);
}
void operator delete[](void* block, size_t, std::align_val_t) noexcept {
  maille::testing::release(block);
}
