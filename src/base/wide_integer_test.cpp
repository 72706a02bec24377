#include "base/wide_integer.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "support/random.h"

namespace maille {
namespace {

#ifdef __SIZEOF_INT128__
/// Both ways to hold a number.
struct Pair {
  __int128 built_in;
  TwoWords ours;
};

bool is(const TwoWords& ours, __int128 built_in) {
  return static_cast<uint64_t>(ours) == static_cast<uint64_t>(built_in) &&
         static_cast<uint64_t>(ours >> 64) == static_cast<uint64_t>(built_in >> 64);
}

/// The ends of 64 bits, small numbers, and numbers of any size.
std::vector<Pair> numbers() {
  std::vector<Pair> all;
  testing::Random random(1);
  for (const int64_t end : {std::numeric_limits<int64_t>::min(), int64_t{-3}, int64_t{0}, int64_t{2},
                            std::numeric_limits<int64_t>::max()}) {
    for (int off = -1; off <= 1; ++off) all.push_back({__int128{end} + off, TwoWords(end) + off});
  }
  for (unsigned bits = 1; bits < 64; bits += 3) {
    const auto value = static_cast<int64_t>(random.next() >> (64 - bits));
    all.push_back({value, value});
    all.push_back({-value, -value});
  }
  return all;
}

TEST(TwoWords, CountAsTheBuiltInTypeDoes) {
  for (const Pair& a : numbers()) {
    EXPECT_TRUE(is(-a.ours, -a.built_in));
    EXPECT_TRUE(is(a.ours * 65535u, a.built_in * 65535u));
    EXPECT_EQ(static_cast<double>(a.ours), static_cast<double>(a.built_in));
    EXPECT_EQ(static_cast<int32_t>(a.ours), static_cast<int32_t>(a.built_in));
    for (const Pair& b : numbers()) {
      EXPECT_TRUE(is(a.ours + b.ours, a.built_in + b.built_in));
      EXPECT_TRUE(is(a.ours - b.ours, a.built_in - b.built_in));
      EXPECT_EQ(a.ours < b.ours, a.built_in < b.built_in);
      EXPECT_EQ(a.ours >= b.ours, a.built_in >= b.built_in);
      EXPECT_EQ(a.ours == b.ours, a.built_in == b.built_in);
      if (a.built_in >= 0 && b.built_in > 0) {
        EXPECT_TRUE(is(a.ours / b.ours, a.built_in / b.built_in));
      }
    }
  }
}

TEST(TwoWords, ShiftAsTheBuiltInTypeDoes) {
  for (const Pair& a : numbers()) {
    for (const unsigned bits : {0u, 1u, 16u, 63u, 64u, 65u, 100u}) {
      EXPECT_TRUE(is(a.ours >> bits, a.built_in >> bits)) << bits;
      EXPECT_TRUE(
          is(a.ours << bits, static_cast<__int128>(static_cast<unsigned __int128>(a.built_in) << bits)))
          << bits;
    }
  }
}
#endif

}  // namespace
}  // namespace maille
