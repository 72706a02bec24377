#include "code/parallelogram.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdint>
#include <limits>

namespace maille {
namespace {

TEST(Parallelogram, IsExactOnFlatLattices) {
  for (int32_t x = -3; x <= 3; ++x) {
    const auto plane = [x](int32_t u, int32_t v) { return 7 * u - 3 * v + x; };
    EXPECT_EQ(parallelogram(plane(1, 0), plane(0, 1), plane(0, 0)), plane(1, 1));
  }
}

TEST(Parallelogram, WrapsAroundAtTheEnds) {
  constexpr int32_t low = std::numeric_limits<int32_t>::min();
  constexpr int32_t high = std::numeric_limits<int32_t>::max();
  EXPECT_EQ(parallelogram(high, high, low), high - 1);  // 3 * 2^31 - 2, modulo 2^32
  EXPECT_EQ(wrapped_sum(high, 1), low);
  EXPECT_EQ(wrapped_difference(low, 1), high);
  constexpr int64_t lowest = std::numeric_limits<int64_t>::min();
  EXPECT_EQ(wrapped_difference(lowest, int64_t{1}), std::numeric_limits<int64_t>::max());
}

RC_GTEST_PROP(Parallelogram, AResidualAlwaysLeadsBack,
              (int32_t value, int32_t a, int32_t b, int32_t across)) {
  const int32_t prediction = parallelogram(a, b, across);
  RC_ASSERT(wrapped_sum(prediction, wrapped_difference(value, prediction)) == value);
  RC_ASSERT(parallelogram(a, b, across) == parallelogram(b, a, across));
}

RC_GTEST_PROP(Parallelogram, AResidualOf64BitsAlwaysLeadsBack,
              (int64_t value, int64_t a, int64_t b, int64_t across)) {
  const int64_t prediction = parallelogram(a, b, across);
  RC_ASSERT(wrapped_sum(prediction, wrapped_difference(value, prediction)) == value);
}

}  // namespace
}  // namespace maille
