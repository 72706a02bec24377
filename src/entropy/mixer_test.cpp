#include "entropy/mixer.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/random.h"

namespace maille::testing {
namespace {

TEST(ShortLanes, DoWhatTheLoopsSay) {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    ShortLanes a, b;
    for (int k = 0; k < 8; ++k) {
      a[k] = static_cast<int16_t>(random.below(65536));
      b[k] = static_cast<int16_t>(random.below(65536));
    }
    const SignedLanes pairs = pair_products(a, b);
    const ShortLanes high = high_products(a, b), sums = saturated_sums(a, b);
    for (int k = 0; k < 8; ++k) {
      EXPECT_EQ(high[k], static_cast<int16_t>(a[k] * b[k] >> 16));
      EXPECT_EQ(sums[k], std::min(std::max(a[k] + b[k], -32768), 32767));
      const int64_t pair = int64_t{a[k & 6]} * b[k & 6] + int64_t{a[k | 1]} * b[k | 1];
      EXPECT_EQ(pairs[k / 2], static_cast<int32_t>(pair));
    }
    const SignedLanes low = {-32768, 32767, a[0], 0}, others = {a[1], a[2], a[3], a[4]};
    const ShortLanes both = shortened(low, others);
    for (int k = 0; k < 4; ++k) {
      EXPECT_EQ(both[k], low[k]);
      EXPECT_EQ(both[k + 4], others[k]);
    }
  }
}

TEST(Mixer, TrustsTheModelThatIsRight) {
  Random random(5);
  Mixer<8> mixer(1, 1, 1, {65536 / 4, 65536 / 4, 65536 / 4});
  double right = 0;
  for (int i = 0; i < 20000; ++i) {
    const bool bit = random.chance(50);
    const bool wrong = random.chance(10);
    Mixer<8>::Inputs inputs = {};
    inputs[0][0] = static_cast<int16_t>(bit != wrong ? 300 : -300);
    inputs[0][1] = static_cast<int16_t>(random.chance(50) ? 2000 : -2000);
    inputs[0][6] = static_cast<int16_t>(random.chance(50) ? 500 : -500);
    const uint32_t probability = mixer.predict(inputs, 0, 0, 0);
    mixer.update(bit);
    if (i >= 10000) right += (bit ? probability : 65536 - probability) / 65536.0 / 10000;
  }
  EXPECT_GT(right, 0.78);  // 0.82 is what can be had
}

TEST(Mixer, InputsThatAreLeftOutAreAsIfTheyWereNone) {
  Random random(7);
  std::array<int32_t, 24> weights;
  weights.fill(65536 / 5);
  Mixer<24> all(1, 1, 1, weights), some(1, 1, 1, weights);
  for (int i = 0; i < 2000; ++i) {
    Mixer<24>::Inputs inputs = {};
    for (int k = 0; k < 16; ++k)
      inputs[static_cast<size_t>(k) / 8][k % 8] =
          static_cast<int16_t>(static_cast<int>(random.below(4000)) - 2000);
    ASSERT_EQ(all.predict(inputs, 0, 0, 0), some.predict(inputs, 0, 0, 0, 2));
    const bool bit = random.chance(30);
    all.update(bit);
    some.update(bit);
  }
}

}  // namespace
}  // namespace maille::testing
