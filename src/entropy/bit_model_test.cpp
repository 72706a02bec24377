#include "entropy/bit_model.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

#include "entropy/rans.h"
#include "support/random.h"

namespace maille {
namespace {

using testing::Random;

TEST(BitLength, CountsSignificantBits) {
  EXPECT_EQ(bit_length(0), 0u);
  EXPECT_EQ(bit_length(1), 1u);
  EXPECT_EQ(bit_length(255), 8u);
  EXPECT_EQ(bit_length(256), 9u);
  EXPECT_EQ(bit_length(UINT64_MAX), 64u);
}

RC_GTEST_PROP(BitModel, DecoderMirrorsEncoder, (const std::vector<bool>& bits)) {
  RansEncoder encoder;
  BitModel model;
  std::vector<uint32_t> probabilities;
  for (const bool bit : bits) {
    probabilities.push_back(model.probability());
    model.code(encoder, bit);
  }
  const auto bytes = encoder.finish();
  RansDecoder decoder(bytes);
  BitModel mirror;
  for (size_t i = 0; i < bits.size(); ++i) {
    RC_ASSERT(mirror.probability() == probabilities[i]);
    RC_ASSERT(mirror.code(decoder, false) == bits[i]);
  }
  RC_ASSERT(mirror.probability() == model.probability());
  RC_ASSERT(!decoder.exhausted());
}

TEST(BitModel, StaysBetweenItsFloors) {
  // 32 of 65536 on either side: no decision is cheaper than 2^-11 bit, which bounds a decoder's work per
  // byte.
  for (const bool bit : {false, true}) {
    RansEncoder encoder;
    BitModel model;
    for (int i = 0; i < 20000; ++i) {
      model.code(encoder, bit);
      ASSERT_GE(model.probability(), 32u);
      ASSERT_LE(model.probability(), 65536u - 32);
    }
    // It gets there but for the rounding of the last steps.
    EXPECT_LE(bit ? 65536 - model.probability() : model.probability(), 32u + 128);
  }
}

TEST(BitModel, FirstVisitsCountMost) {
  RansEncoder encoder;
  BitModel model;
  EXPECT_EQ(model.probability(), 32768u);
  // Krichevsky and Trofimov: (ones + 1/2) / (all + 1) after one, two, three ones: 3/4 to 7/8.
  const double expected[] = {0.75, 0.8333, 0.875};
  uint32_t before = model.probability();
  uint32_t step_before = 65536;
  for (int i = 0; i < 3; ++i) {
    model.code(encoder, true);
    EXPECT_NEAR(model.probability() / 65536.0, expected[i], 0.1);
    const uint32_t step = model.probability() - before;
    EXPECT_LT(step, step_before);
    before = model.probability();
    step_before = step;
  }
}

TEST(BitModel, FollowsASourceThatChanges) {
  RansEncoder encoder;
  BitModel model;
  for (int i = 0; i < 5000; ++i) model.code(encoder, true);
  for (int i = 0; i < 500; ++i) model.code(encoder, false);
  EXPECT_LT(model.probability(), 6554u);
}

TEST(BitModel, CostsTheEntropyOfItsSource) {
  for (const unsigned percent : {50u, 80u, 95u, 99u}) {
    Random random(percent);
    RansEncoder encoder;
    BitModel model;
    for (int i = 0; i < 40000; ++i) model.code(encoder, random.chance(percent));
    const double p = percent / 100.0;
    const double entropy = -p * std::log2(p) - (1 - p) * std::log2(1 - p);
    const double cost = 8.0 * static_cast<double>(encoder.finish().size()) / 40000;
    EXPECT_GT(cost, entropy * 0.93) << percent;
    EXPECT_LT(cost, entropy * 1.05 + 0.005) << percent;
  }
}

}  // namespace
}  // namespace maille
