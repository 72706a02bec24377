#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace maille {

/// Some of many numbers, and how many of them are below each: a bit for each of the many and a count for 64.
/// For meshes cut into parts: which points a part uses, and their numbers in it, without a table of 4 bytes
/// for each point of the whole mesh. First all add(), then count(), then rank() and numbers().
class RankedSet {
 public:
  /// `many`: how many numbers there could be, which takes an eighth of a byte and a count for 64 each.
  explicit RankedSet(uint64_t many) : words_(many / 64 + 1), before_(many / 64 + 1) {}
  /// Below the many. False: it was there already.
  bool add(uint32_t number) {
    const uint64_t before = words_[number / 64];
    words_[number / 64] |= uint64_t{1} << number % 64;
    return words_[number / 64] != before;
  }
  /// Behind the last add().
  void count() {
    uint32_t sum = 0;
    for (size_t i = 0; i < words_.size(); ++i) {
      before_[i] = sum;
      sum += static_cast<uint32_t>(__builtin_popcountll(words_[i]));
    }
    size_ = sum;
  }
  uint32_t size() const { return size_; }
  /// How many of the set are below a number; in constant time, by one count of bits.
  uint32_t rank(uint32_t number) const {
    const uint64_t below = words_[number / 64] & ((uint64_t{1} << number % 64) - 1);
    return before_[number / 64] + static_cast<uint32_t>(__builtin_popcountll(below));
  }
  std::vector<uint32_t> numbers() const {
    std::vector<uint32_t> all;
    all.reserve(size_);
    for (size_t i = 0; i < words_.size(); ++i) {
      for (uint64_t word = words_[i]; word != 0; word &= word - 1)
        all.push_back(static_cast<uint32_t>(i * 64) + static_cast<uint32_t>(__builtin_ctzll(word)));
    }
    return all;
  }

 private:
  std::vector<uint64_t> words_;
  std::vector<uint32_t> before_;
  uint32_t size_ = 0;
};

/// Makes of each number its rank among all of them, and returns the number of each rank: rising, each once.
/// Nothing is sorted; it takes a set of the numbers from the lowest to the highest.
inline std::vector<uint32_t> rank_all(std::span<uint32_t> numbers) {
  if (numbers.empty()) return {};
  const auto [low, high] = std::minmax_element(numbers.begin(), numbers.end());
  const uint32_t first = *low;
  RankedSet set(uint64_t{*high} - first + 1);
  for (const uint32_t number : numbers) set.add(number - first);
  set.count();
  for (uint32_t& number : numbers) number = set.rank(number - first);
  std::vector<uint32_t> ranked = set.numbers();
  for (uint32_t& number : ranked) number += first;
  return ranked;
}

}  // namespace maille
