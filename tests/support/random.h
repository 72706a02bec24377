#pragma once

#include <cstddef>
#include <cstdint>

namespace maille::testing {

/// A small generator (splitmix64) with the same numbers on every machine and library; std:: distributions
/// differ.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}

  uint64_t next() {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  /// 0 ... n - 1; 0 when n is 0. The bias of the remainder does not matter here.
  uint32_t below(uint64_t n) { return n == 0 ? 0 : static_cast<uint32_t>(next() % n); }
  /// first ... last, both included.
  uint32_t between(uint32_t first, uint32_t last) { return first + below(uint64_t{last} - first + 1); }
  bool chance(unsigned percent) { return below(100) < percent; }
  /// 0 <= x < 1.
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }

 private:
  uint64_t state_;
};

/// Fisher and Yates, the same on every machine (std::shuffle is not).
template <class Container>
void shuffle(Container& items, Random& random) {
  for (size_t i = items.size(); i > 1; --i) {
    const size_t j = random.below(i);
    auto held = items[i - 1];
    items[i - 1] = items[j];
    items[j] = held;
  }
}

}  // namespace maille::testing
