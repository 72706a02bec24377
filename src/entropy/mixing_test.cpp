#include "entropy/mixing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "entropy/bit_model.h"
#include "entropy/integer_model.h"
#include "support/random.h"

namespace maille {
namespace {

using testing::Random;

TEST(MixingTables, AreTheFunctionsTheyStandFor) {
  for (int i = 0; i < 4096; ++i) {
    const double p = 1 / (1 + std::exp(-(i - 2048) / 256.0));
    EXPECT_NEAR(logistic_table[static_cast<size_t>(i)], 65536 * p, 0.5001);
    const double q = (i + 0.5) / 4096;
    EXPECT_NEAR(logit_table[static_cast<size_t>(i)],
                std::max(-2047.0, std::min(2047.0, 256 * std::log(q / (1 - q)))), 0.5001);
  }
  for (int i = 0; i < 2 * 20 * 64 + 2; ++i) {
    const double p = 1 / (1 + std::exp(-(i - 1280) / 64.0));
    EXPECT_NEAR(distribution_table[static_cast<size_t>(i)], 1073741824 * p, 0.5001);
  }
}

TEST(MixingTables, DistributionRisesWithItsArgument) {
  int32_t before = 0;
  for (int32_t i = -largest_deviation; i <= largest_deviation; ++i) {
    const int32_t mass = distribution(i);
    ASSERT_GE(mass, before) << i;
    before = mass;
  }
  EXPECT_LT(distribution(-largest_deviation), 10);
  EXPECT_GT(distribution(largest_deviation), (1 << 30) - 10);
}

TEST(MixingTables, LogitsOfRatiosAreNearlyRight) {
  Random random(1);
  for (int i = 0; i < 100000; ++i) {
    const auto a = static_cast<int32_t>(random.between(1, 1u << random.between(0, 30)));
    const auto b = static_cast<int32_t>(random.between(1, 1u << random.between(0, 30)));
    const SignedLanes logits = logit_of_ratio(SignedLanes{a, b, 1, 1 << 30}, SignedLanes{b, a, 1 << 30, 1});
    const double exact = std::max(-2047.0, std::min(2047.0, 256 * std::log(double(a) / b)));
    ASSERT_NEAR(logits[0], exact, 1.1);
    ASSERT_NEAR(logits[1], -exact, 1.1);
    ASSERT_EQ(logits[2], -largest_logit);
    ASSERT_EQ(logits[3], largest_logit);
  }
}

/// Decisions with probabilities that fit them or not, raw numbers and symbols, the same for any coder.
template <class Coder>
bool run(Coder& coder, uint64_t seed, int count) {
  Random random(seed);
  BitModel bit_model;
  CountModel count_model;
  for (int i = 0; i < count; ++i) {
    const uint32_t probability = random.chance(50)   ? random.between(24, 65512)
                                 : random.chance(50) ? 24
                                                     : 65512;
    const bool bit = random.below(65536) < probability || random.chance(5);
    if (coder.code(bit, probability) != bit && !Coder::encoding) return false;
    const unsigned bits = random.below(33);
    const auto raw = static_cast<uint32_t>(random.next() & ((uint64_t{1} << bits) - 1));
    if (coder.code_raw(raw, bits) != raw) return false;
    const uint32_t number = random.below(1u << random.below(20));
    if (count_model.code(coder, number) != number) return false;
    if (bit_model.code(coder, number % 3 == 0) != (number % 3 == 0)) return false;
    if (coder.exhausted()) return false;
  }
  return true;
}

TEST(RangeCoder, EveryOperationComesBack) {
  for (uint64_t seed = 0; seed < 300; ++seed) {
    const int count = static_cast<int>(seed * seed / 20);
    RangeEncoder encoder;
    ASSERT_TRUE(run(encoder, seed, count));
    const auto bytes = encoder.finish();
    RangeDecoder decoder(bytes);
    ASSERT_TRUE(run(decoder, seed, count)) << seed;
  }
}

TEST(RangeCoder, CarriesRunThroughManyWords) {
  // Always the upper end of the interval: the encoder's number is all ones until a last step up.
  for (uint32_t count = 1; count < 300; ++count) {
    RangeEncoder encoder;
    for (uint32_t i = 0; i < count; ++i) encoder.code(false, 65512 - i % 3);
    encoder.code(true, 24);
    const auto bytes = encoder.finish();
    RangeDecoder decoder(bytes);
    for (uint32_t i = 0; i < count; ++i) ASSERT_FALSE(decoder.code(false, 65512 - i % 3));
    ASSERT_TRUE(decoder.code(false, 24));
    EXPECT_FALSE(decoder.exhausted());
  }
}

TEST(RangeCoder, CostsWhatTheProbabilitiesSay) {
  Random random(3);
  RangeEncoder encoder;
  double bits = 0;
  for (int i = 0; i < 100000; ++i) {
    const uint32_t probability = random.between(24, 65512);
    const bool bit = random.below(65536) < probability;
    bits -= std::log2((bit ? probability : 65536 - probability) / 65536.0);
    encoder.code(bit, probability);
  }
  EXPECT_NEAR(static_cast<double>(encoder.finish().size()) * 8, bits, 100);
}

TEST(RangeCoder, NoticesEveryTruncation) {
  RangeEncoder encoder;
  ASSERT_TRUE(run(encoder, 7, 40));
  const auto bytes = encoder.finish();
  for (size_t size = 0; size < bytes.size(); ++size) {
    RangeDecoder decoder(Bytes(bytes).first(size));
    EXPECT_FALSE(run(decoder, 7, 40)) << size;
  }
}

TEST(RangeCoder, RunsOutOfAnyBytesInTime) {
  for (uint64_t seed = 0; seed < 100; ++seed) {
    Random random(seed);
    std::vector<std::byte> bytes(random.below(30));
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.chance(50) ? 255 : random.below(256));
    RangeDecoder decoder(bytes);
    const uint32_t probability = random.chance(50) ? least_probability : 65536 - least_probability;
    uint64_t decisions = 0;
    while (!decoder.exhausted() && decisions < 1000000) decisions += decoder.code(false, probability) ? 1 : 1;
    EXPECT_LE(decisions, (bytes.size() + 16) * 16384);
  }
}

template <class Cell>
void expect_learns() {
  Random random(2);
  for (const uint32_t percent : {3u, 30u, 50u, 95u}) {
    Cell cell;
    EXPECT_EQ(cell.logit(), 0);
    double mean = 0;
    for (int i = 0; i < 2000; ++i) {
      cell.update(random.chance(percent));
      if (i >= 1000) mean += probability_of(cell.logit()) / 65536.0 / 1000;
    }
    EXPECT_NEAR(mean, percent / 100.0, 0.05) << percent;
  }
}

TEST(Cells, LearnTheProbabilityOfTheirDecision) {
  expect_learns<WideCell>();
  expect_learns<NarrowCell>();
}

TEST(BucketTable, FindsWhatItGaveUntilOthersTakeItsPlace) {
  BucketTable table(10);
  for (uint32_t i = 0; i < 200; ++i) table.find(hashed(i, 1)).cells[0].update(true);
  unsigned kept = 0;
  for (uint32_t i = 0; i < 200; ++i) kept += table.find(hashed(i, 1)).cells[0].visits() == 1;
  EXPECT_GT(kept, 180u);
}

}  // namespace
}  // namespace maille
