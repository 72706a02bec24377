#include "code/online_least_squares.h"

#include <gtest/gtest.h>

#include <limits>

#include "support/random.h"

namespace maille {
namespace {

using testing::Random;

std::array<float, 4> random_features(Random& random) {
  std::array<float, 4> features;
  for (float& feature : features) feature = static_cast<float>(random.unit() * 200 - 100);
  return features;
}

TEST(OnlineLeastSquares, LearnsALinearRule) {
  Random random(1);
  OnlineLeastSquares<4> squares;
  for (int i = 0; i < 200; ++i) {
    const auto f = random_features(random);
    squares.learn(f, 2 * f[0] - 0.5F * f[2], 1);
  }
  const auto f = random_features(random);
  EXPECT_NEAR(squares.predict(f), 2 * f[0] - 0.5F * f[2], 0.5);
}

TEST(OnlineLeastSquares, FollowsARuleThatChanges) {
  Random random(2);
  OnlineLeastSquares<4> squares;
  for (int i = 0; i < 40000; ++i) {
    const auto f = random_features(random);
    squares.learn(f, i < 20000 ? f[1] : -f[1], 0.5F);
  }
  const auto f = random_features(random);
  EXPECT_NEAR(squares.predict(f), -f[1], 1);
}

TEST(OnlineLeastSquares, StaysFiniteWhateverItLearns) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed);
    OnlineLeastSquares<4> squares;
    const float wild[] = {0,      1,      -1e30F, 1e30F,
                          1e-30F, 999999, -5e5F,  std::numeric_limits<float>::quiet_NaN()};
    for (int i = 0; i < 300; ++i) {
      std::array<float, 4> f;
      for (float& feature : f) feature = wild[random.below(8)];
      squares.learn(f, wild[random.below(8)], wild[random.below(2)] + 0.1F);
    }
    const double prediction = squares.predict({1, 1, 1, 1});
    EXPECT_TRUE(prediction > -1e6 && prediction < 1e6) << seed;
  }
}

}  // namespace
}  // namespace maille
