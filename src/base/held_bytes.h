#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace maille {

/// What a vector takes, with the room that it has not used yet.
template <class T, class Allocator>
uint64_t bytes_held(const std::vector<T, Allocator>& vector) {
  return uint64_t{vector.capacity()} * sizeof(T);
}
/// What it takes while it comes to have `size` elements: where it has no room for them it takes twice as
/// much, and while they move the old room is there, too.
template <class T, class Allocator>
uint64_t bytes_to_hold(const std::vector<T, Allocator>& vector, uint64_t size) {
  if (size <= vector.capacity()) return bytes_held(vector);
  return (vector.capacity() + std::max<uint64_t>(2 * uint64_t{vector.size()}, size)) * sizeof(T);
}

}  // namespace maille
