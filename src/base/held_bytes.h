#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace maille {

/// What a vector takes. Room that it has but never used is memory that nothing touched, and does not count.
template <class T, class Allocator>
uint64_t bytes_held(const std::vector<T, Allocator>& vector) {
  return uint64_t{vector.size()} * sizeof(T);
}
/// What it takes while it comes to have `size` elements: where it has no room for them, the old ones are
/// there twice.
template <class T, class Allocator>
uint64_t bytes_to_hold(const std::vector<T, Allocator>& vector, uint64_t size) {
  const uint64_t moved = size <= vector.capacity() ? 0 : vector.size();
  return (std::max<uint64_t>(vector.size(), size) + moved) * sizeof(T);
}

}  // namespace maille
