#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace maille {

/// For lists that nearly always have three or so, but may have any number: by insertion, without a call.
/// Beyond 16, where insertion would take its square, by std::sort(), so that a damaged or hostile mesh takes
/// no long time.
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
