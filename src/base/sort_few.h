#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace maille {

/// Sorts lists that nearly always have about three numbers, but may have any number of them. Insertion needs
/// no call; beyond 16 numbers std::sort() keeps a damaged or hostile mesh from taking quadratic time.
inline void sort_few(std::span<uint64_t> numbers) {
  if (numbers.size() > 16) {
    std::sort(numbers.begin(), numbers.end());
    return;
  }
  for (size_t i = 1; i < numbers.size(); ++i) {
    const uint64_t number = numbers[i];
    size_t at = i;
    for (; at > 0 && numbers[at - 1] > number; --at) numbers[at] = numbers[at - 1];
    numbers[at] = number;
  }
}

}  // namespace maille
