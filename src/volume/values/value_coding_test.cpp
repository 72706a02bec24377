#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <random>

#include "entropy/rans.h"
#include "volume/values/lane_least_squares.h"
#include "volume/values/value_residuals.h"

namespace maille {
namespace {

TEST(LaneLeastSquares, LearnsARuleInEachLane) {
  using Squares = LaneLeastSquares<4, 3>;
  Squares squares;
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    Squares::Features features;
    for (auto& feature : features) {
      for (int lane = 0; lane < 4; ++lane) feature[lane] = static_cast<float>(random() % 2001) * 1e-3F - 1;
    }
    Squares::Floats target;
    for (int lane = 0; lane < 4; ++lane)
      target[lane] = static_cast<float>(lane) * features[0][lane] - 2 * features[1][lane];
    squares.learn(features, target, Squares::Floats{} + 1.0F);
  }
  for (int lane = 0; lane < 4; ++lane) {
    EXPECT_NEAR(squares.weights()[0][lane], lane, 0.01);
    EXPECT_NEAR(squares.weights()[1][lane], -2, 0.01);
    EXPECT_NEAR(squares.weights()[2][lane], 0, 0.01);
  }
}

TEST(LaneLeastSquares, ALaneThatLearnsInfinitiesDoesNotDisturbAnother) {
  using Squares = LaneLeastSquares<4, 3>;
  constexpr float infinity = std::numeric_limits<float>::infinity();
  Squares disturbed, alone;
  std::mt19937 random(2);
  for (int i = 0; i < 500; ++i) {
    Squares::Features features, bad;
    for (unsigned k = 0; k < 3; ++k) {
      features[k] = Squares::Floats{} + static_cast<float>(random() % 100) * 0.01F;
      bad[k] = features[k];
      bad[k][2] = i % 3 == 0 ? infinity : i % 3 == 1 ? -infinity : std::numeric_limits<float>::quiet_NaN();
    }
    alone.learn(features, features[1], Squares::Floats{} + 1.0F);
    disturbed.learn(bad, features[1], Squares::Floats{} + 1.0F);
  }
  for (unsigned k = 0; k < 3; ++k) {
    EXPECT_EQ(disturbed.weights()[k][0], alone.weights()[k][0]);
    EXPECT_EQ(disturbed.weights()[k][2], 0);
  }
  EXPECT_GT(alone.weights()[1][0], 0.9F);
}

/// What residuals take; they must come back.
template <unsigned Bits>
size_t code_residuals(const std::vector<int64_t>& residuals, unsigned expected, unsigned spread) {
  RansEncoder encoder(3);
  ValueResiduals<Bits> writing;
  unsigned at = 0;
  for (const int64_t residual : residuals) {
    const ResidualContext context = {(expected + at) % (2 * Bits), spread};
    const unsigned first = writing.code_first(encoder, residual, at % 3, context, at % 3);
    writing.code_rest(encoder, residual, first, at % 3, at % 3);
    at += expected == 20 ? 0 : 1;
  }
  const std::vector<std::byte> bytes = encoder.finish();
  RansDecoder decoder(bytes, 3);
  ValueResiduals<Bits> reading;
  at = 0;
  for (const int64_t residual : residuals) {
    const ResidualContext context = {(expected + at) % (2 * Bits), spread};
    const unsigned first = reading.code_first(decoder, 0, at % 3, context, at % 3);
    EXPECT_EQ(reading.code_rest(decoder, 0, first, at % 3, at % 3), residual);
    at += expected == 20 ? 0 : 1;
  }
  EXPECT_FALSE(decoder.exhausted());
  return bytes.size();
}

RC_GTEST_PROP(ValueResiduals, GiveBackAnyResidual, ()) {
  const auto wide = *rc::gen::container<std::vector<int64_t>>(rc::gen::arbitrary<int64_t>());
  std::vector<int64_t> narrow;
  for (const int64_t each : wide) narrow.push_back(static_cast<int32_t>(each >> (each & 31)));
  narrow.push_back(std::numeric_limits<int32_t>::min());
  const auto expected = *rc::gen::inRange(0u, 64u);
  const auto spread = *rc::gen::inRange(0u, 12u);
  code_residuals<64>(wide, expected, spread);
  code_residuals<32>(narrow, expected, spread);
}

TEST(ValueResiduals, TakeALowByteThatComesAgainForLittle) {
  std::mt19937 random(3);
  std::vector<int64_t> again, noise;
  for (int i = 0; i < 20000; ++i) {
    const int64_t head = (8 + static_cast<int64_t>(random() % 8)) << 8;
    again.push_back(head | 0x5a);
    noise.push_back(head | static_cast<int64_t>(random() % 256));
  }
  const size_t least = 20000 * 3 / 8;  // the head
  EXPECT_LT(code_residuals<32>(again, 20, 0), least * 11 / 10);
  EXPECT_LT(code_residuals<32>(noise, 20, 0), (least + 20000) * 101 / 100);
}

}  // namespace
}  // namespace maille
