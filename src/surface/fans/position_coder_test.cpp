#include "surface/fans/position_coder.h"

#include <gtest/gtest.h>

#include <limits>

namespace maille::positions {
namespace {

TEST(SizesOfKnown, OfFloatsAreThoseOfIntegers) {
  for (unsigned base = 0; base <= most_narrow_base; ++base) {
    const SizesOfKnown sizes(base);
    const auto check = [&](int32_t residual) {
      const uint64_t magnitude = residual < 0 ? uint64_t{0} - static_cast<uint64_t>(int64_t{residual})
                                              : static_cast<uint64_t>(residual);
      const SignedLanes octaves = SizesOfKnown::octaves_of(SignedLanes{residual, 0, 1, -1});
      EXPECT_EQ(sizes.of_octave(octaves[0]), sizes.of(magnitude)) << base << " " << residual;
    };
    for (int32_t residual = -300; residual <= 300; ++residual) check(residual);
    // Where a length begins, and its upper half.
    for (unsigned length = 9; length < 31; ++length) {
      for (const int32_t first : {1 << length, 3 << (length - 1)}) {
        for (int32_t step = -1; step <= 1; ++step) {
          check(first + step);
          check(-first - step);
        }
      }
    }
    check(std::numeric_limits<int32_t>::max());
    check(std::numeric_limits<int32_t>::min());
  }
}

TEST(Indices, OfOthersStayWhereOneIsSet) {
  Indices indices;
  indices.set(1, Dictionary::most - 1);
  indices.set(1, 5);
  EXPECT_EQ(indices[0], uint32_t{Indices::no_index});
  EXPECT_EQ(indices[1], 5u);
  EXPECT_EQ(indices[2], uint32_t{Indices::no_index});
}

}  // namespace
}  // namespace maille::positions
