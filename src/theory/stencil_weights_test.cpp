#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "theory/testing.h"

// Published schemes and closed forms, derived again. Names of papers: docs/prediction.md.
namespace maille::testing {
namespace {

const double pi = std::acos(-1.0);

TEST(StencilWeights, ATriangleIsContinuedByAParallelogram) {
  for (const Covariance covariance : all_covariances) {
    expect_weights(weights_of("parallelogram", taylor_rule(covariance)), {1, 1, -1});
    expect_weights(weights_of("quad", taylor_rule(covariance)), {1, -1, 1});
  }
  EXPECT_EQ(usual_prediction("parallelogram").exactness, 1);
  EXPECT_NEAR(usual_prediction("parallelogram").noise_gain, 3, 1e-12);
}

TEST(StencilWeights, ButterflyIsTaylorOfOrder3InEveryVariant) {
  const std::vector<double> butterfly = {.5, .5, .125, .125, -.0625, -.0625, -.0625, -.0625};
  for (const Covariance covariance : all_covariances) {
    expect_weights(weights_of("butterfly", taylor_rule(covariance)), butterfly);
    expect_weights(weights_of("butterfly", taylor_rule(covariance, 3)), butterfly);
  }
  EXPECT_EQ(usual_prediction("butterfly").exactness, 3);
}

TEST(StencilWeights, TenPointsGiveTheButterflyOfParameter1Over64) {
  const double w = 1.0 / 64;
  const double a = .5 - w, b = .125 + 2 * w, c = -.0625 - w;
  for (const unsigned order : {2u, 3u}) {
    expect_weights(weights_of("butterfly-10", taylor_rule(Covariance::rotation, order)),
                   {a, a, b, b, c, c, c, c, w, w});
  }
}

TEST(StencilWeights, ModifiedButterflyIsTaylorOfOrder2) {
  expect_weights(weights_of("modified-butterfly:3"), {.75, 5.0 / 12, -1.0 / 12, -1.0 / 12});
  expect_weights(weights_of("modified-butterfly:4"), {.75, .375, 0, -.125, 0});
  for (unsigned k = 5; k <= 16; ++k) {
    std::vector<double> zorin = {.75};
    for (unsigned j = 0; j < k; ++j) {
      zorin.push_back((.25 + std::cos(2 * pi * j / k) + .5 * std::cos(4 * pi * j / k)) / k);
    }
    expect_weights(weights_of("modified-butterfly:" + std::to_string(k)), zorin);
    EXPECT_EQ(usual_prediction("modified-butterfly:" + std::to_string(k)).exactness, 2) << k;
  }
}

TEST(StencilWeights, Sqrt3OfLabsikAndGreinerIsTaylorOfOrder3) {
  std::vector<double> expected(3, 32.0 / 81);
  expected.insert(expected.end(), 3, -1.0 / 81);
  expected.insert(expected.end(), 6, -2.0 / 81);
  expect_weights(weights_of("sqrt3", taylor_rule(Covariance::rotation, 3)), expected);
  expect_weights(weights_of("sqrt3", taylor_rule(Covariance::gaussian, 3)), expected);
  expect_weights(weights_of("sqrt3", taylor_rule(Covariance::rotation)), expected);
  expect_weights(weights_of("sqrt3", taylor_rule(Covariance::gaussian)), expected);
}

TEST(StencilWeights, Sqrt3OnSixPointsIsExactForQuadrics) {
  for (const Covariance covariance : all_covariances) {
    expect_weights(weights_of("sqrt3-small", taylor_rule(covariance)),
                   {4.0 / 9, 4.0 / 9, 4.0 / 9, -1.0 / 9, -1.0 / 9, -1.0 / 9});
  }
  EXPECT_EQ(usual_prediction("sqrt3-small").exactness, 2);
}

TEST(StencilWeights, Sqrt3OfAnExtraordinaryVertexHasAClosedForm) {
  const double r = std::sqrt(1.0 / 3);
  for (unsigned k = 5; k <= 16; ++k) {
    std::vector<double> expected = {1 - r * r};
    for (unsigned j = 0; j < k; ++j) {
      const double angle = 2 * pi * j / k - pi / k;
      expected.push_back((r * r + 2 * r * std::cos(angle) + 2 * r * r * std::cos(2 * angle)) / k);
    }
    expect_weights(weights_of("sqrt3-ring:" + std::to_string(k)), expected);
  }
}

TEST(StencilWeights, KStarsNeedOneNumberFromTheRadiusOfTheTips) {
  for (unsigned k = 3; k <= 16; ++k) {
    const double reflected = 2 * std::cos(pi / k);
    const double equilateral = std::cos(pi / k) + std::sqrt(3.0) * std::sin(pi / k);
    for (const auto& [tips, rho] : {std::pair{":reflected", reflected},
                                    std::pair{":equilateral", equilateral}, std::pair{":1.75", 1.75}}) {
      // Where the tips lie on the ring itself, only order 3 tells the two apart.
      const double alpha = std::fabs(rho - 1) < 1e-9 ? .5 : rho * rho / (rho * rho - 1);
      std::vector<double> expected(k, alpha / k);
      expected.insert(expected.end(), k, (1 - alpha) / k);
      for (const Covariance covariance : {Covariance::rotation, Covariance::gaussian}) {
        const auto weights = weights_of("k-star:" + std::to_string(k) + tips, taylor_rule(covariance));
        // Differences between the weights of a ring are settled by orders up to K / 2 only.
        expect_weights(weights, expected, k < 10 ? 1e-12 : 1e-9);
        EXPECT_NEAR(std::accumulate(weights.begin(), weights.begin() + k, 0.0), alpha, 1e-12);
      }
    }
  }
  EXPECT_NEAR(6 * weights_of("k-star:6")[0], 1.5, 1e-12);
  EXPECT_NEAR(4 * weights_of("k-star:4")[0], 2, 1e-12);
}

TEST(StencilWeights, NoiseMovesAKStarFromTaylorToTheMeanOfAll) {
  for (unsigned k = 4; k <= 16; ++k) {
    const double rho2 = 4 * std::cos(pi / k) * std::cos(pi / k);
    for (const double noise : {1e-6, .05, .2, 1.0, 1e6}) {
      const double alpha =
          (rho2 * (rho2 - 1) / 4 + noise / k) / ((rho2 - 1) * (rho2 - 1) / 4 + 2 * noise / k);
      const auto weights = weights_of("k-star:" + std::to_string(k), noise_rule(Covariance::rotation, noise));
      EXPECT_NEAR(weights[0] * k, alpha, 1e-9) << k << " " << noise;
      EXPECT_NEAR(weights[k] * k, 1 - alpha, 1e-9) << k << " " << noise;
    }
  }
  EXPECT_NEAR(6 * weights_of("k-star:6", noise_rule(Covariance::rotation, .2))[0], 1.4375, 1e-12);
  EXPECT_NEAR(6 * weights_of("k-star:6", noise_rule(Covariance::rotation, 1))[0], 1.25, 1e-12);
}

TEST(StencilWeights, DualParallelogramDependsOnTheCovarianceOfSecondDerivatives) {
  const std::string name = "dual-parallelogram:6";
  expect_weights(weights_of(name, taylor_rule(Covariance::rotation)), {.6, .6, .6, -.4, -.4});
  expect_weights(weights_of(name, taylor_rule(Covariance::independent)), {.6, .6, .6, -.4, -.4});
  expect_weights(weights_of(name, taylor_rule(Covariance::gaussian)),
                 {1.0 / 3, 2.0 / 3, 2.0 / 3, -1.0 / 3, -1.0 / 3});
  expect_weights(weights_of(name, taylor_rule(Covariance::rotation, 1)), {.2, .7, .7, -.3, -.3});
}

TEST(StencilWeights, DualParallelogramsOfOtherValences) {
  struct Row {
    unsigned valence;
    Covariance covariance;
    double focus, near, far;
  };
  const Row rows[] = {
      {5, Covariance::rotation, 1, .4472, -.4472},     {5, Covariance::gaussian, .5556, .608, -.3858},
      {7, Covariance::rotation, .437, .665, -.3836},   {7, Covariance::gaussian, .2637, .6878, -.3197},
      {8, Covariance::rotation, .2929, .7071, -.3536}, {8, Covariance::gaussian, .1953, .7071, -.3047}};
  for (const Row& row : rows) {
    expect_weights(
        weights_of("dual-parallelogram:" + std::to_string(row.valence), taylor_rule(row.covariance)),
        {row.focus, row.near, row.near, row.far, row.far}, 1e-4);
  }
  expect_weights(weights_of("dual-parallelogram:4"), {2, 0, 0, -1});
}

TEST(StencilWeights, PolygonsAreContinuedByTheirLowestFrequencies) {
  for (unsigned n = 4; n <= 16; ++n) {
    const double a = 1 + 2 * std::cos(2 * pi / n);
    for (const Covariance covariance : {Covariance::rotation, Covariance::gaussian}) {
      expect_weights(weights_of("polygon:" + std::to_string(n) + ":3", taylor_rule(covariance)), {1, -a, a});
    }
  }
  const double phi = (1 + std::sqrt(5.0)) / 2;
  expect_weights(weights_of("polygon:5:4"), {phi / 2, .5 - phi / 2, .5 - phi / 2, phi / 2});
  expect_weights(weights_of("polygon:6:4"), {.5, 0, -1, 1.5});
  expect_weights(weights_of("polygon:6:5"), {1, -1, 1, -1, 1});
  const double d = std::sqrt(2.0);
  expect_weights(weights_of("polygon:8:4"), {0, 1, -1 - d, 1 + d});
  expect_weights(weights_of("polygon:8:5"), {1, -1 - d, 2 + d, -2 - d, 1 + d});
  expect_weights(weights_of("polygon:8:6"), {d / 2, -d / 2, 0, 1, -1 - d / 2, 1 + d / 2});
  expect_weights(weights_of("polygon:7:6"), {.9010, -.6235, .2225, .2225, -.6235, .9010}, 1e-4);
  expect_weights(weights_of("polygon:7:4"), {.2225, .5, -1.7470, 2.0245}, 1e-4);
  expect_weights(weights_of("polygon:9:6"), {.5, -.4397, -.6737, 2.2057, -2.9718, 2.3794}, 1e-4);
}

TEST(StencilWeights, TaylorAndSpectralAgreeOnPolygons) {
  for (unsigned n = 4; n <= 16; ++n) {
    for (unsigned known = 3; known < n; ++known) {
      const std::string name = "polygon:" + std::to_string(n) + ":" + std::to_string(known);
      const auto taylor = weights_of(name);
      const auto spectral = weights_of(name, spectral_rule());
      // Many known corners of a large polygon are far apart in size: the last digits go.
      expect_weights(taylor, spectral, n <= 9 ? 1e-10 : 1e-5);
    }
  }
}

TEST(StencilWeights, PolygonsBesideAKnownOne) {
  expect_weights(weights_of("polygon-beside:3:3"), {1, 1, -1});
  expect_weights(weights_of("polygon-beside:4:4"), {2, 0, 0, -1});
  expect_weights(weights_of("polygon-beside:4:4:1"), {-2, 2, -1, 1, 1});
  expect_weights(weights_of("polygon-beside:4:3"), {.9330, .9330, -.4330, -.4330}, 1e-4);
  expect_weights(weights_of("polygon-beside:3:4"), {1.5774, .5774, -1.1547}, 1e-4);
  expect_weights(weights_of("polygon-beside:4:6"), {2.7990, -.9330, .4330, -1.2990}, 1e-4);
  expect_weights(weights_of("polygon-beside:5:5"), {2.7889, -.4472, -.4472, .5528, -1.4472}, 1e-4);
  expect_weights(weights_of("polygon-beside:6:6"), {3.5, -1.5, .5, -.5, .5, -1.5});
}

TEST(StencilWeights, LatticesByTaylorAndSpectrumAreTheSame) {
  struct Row {
    const char* picture;
    std::vector<double> weights;
  };
  const Row rows[] = {{"##/#x", {-1, 1, 1}},
                      {"###/##x", {1, -2, 1, -1, 2}},
                      {"###/###/#x.", {1, -1, 0, -2, 2, 0, 1}},
                      {"###/###/##x", {-1, 2, -1, 2, -4, 2, -1, 2}},
                      {"###/#x#/###", {-.25, .5, -.25, .5, .5, -.25, .5, -.25}}};
  for (const Row& row : rows) {
    const std::string name = std::string("grid:") + row.picture;
    expect_weights(weights_of(name), row.weights);
    expect_weights(weights_of(name, spectral_rule()), row.weights);
  }
}

/// The 3 x 3 lattice with this target; the other places are known where bits of `mask` are set.
std::string picture_of(unsigned target, unsigned mask) {
  std::string picture = "grid:";
  for (unsigned place = 0; place < 9; ++place) {
    if (place == 3 || place == 6) picture += '/';
    const unsigned bit = place < target ? place : place - 1;
    picture += place == target ? 'x' : (mask >> bit & 1) != 0 ? '#' : '.';
  }
  return picture;
}

TEST(StencilWeights, On3x3LatticesTaylorAndSpectrumAgreeWheneverDegree2IsReached) {
  unsigned reached = 0;
  for (unsigned target = 0; target < 9; ++target) {
    for (unsigned mask = 1; mask < 256; ++mask) {
      const std::string name = picture_of(target, mask);
      const Prediction taylor = usual_prediction(name);
      if (taylor.exactness < 2) continue;
      ++reached;
      expect_weights(taylor.weights, weights_of(name, spectral_rule()), 1e-10);
    }
  }
  EXPECT_EQ(reached, 357u);
}

TEST(StencilWeights, CubesHaveTheWeightsOfTheirSpectrum) {
  expect_weights(weights_of("cube:0xfe"), {1, 1, -1, 1, -1, -1, 1});  // Lorenzo predictor
  const double t = 1.0 / 3;
  expect_weights(weights_of("cube:0x7e"), {2 * t, 2 * t, -t, 2 * t, -t, -t});
  expect_weights(weights_of("cube:0x0e"), {1, 1, -1});
  expect_weights(weights_of("cube:0x06"), {.5, .5});
  expect_weights(weights_of("cube:0x02"), {1});
  expect_weights(weights_of("cube:0x16"), {t, t, t});
  expect_weights(weights_of("cube:0xe8"), {1, 1, 1, -2});
  expect_weights(weights_of("cube:0x3e"), {1, .5, -.5, .5, -.5});
  EXPECT_TRUE(weights_of("cube:0").empty());
}

TEST(StencilWeights, HexahedraContinueWhatLiesBehindTheirFace) {
  // Far layer 00 10 11 01, shared face in the same order, then new corners.
  expect_weights(weights_of("hexahedron:0"), {-1, 0, 0, 0, 2, 0, 0, 0});
  expect_weights(weights_of("hexahedron:1"), {1, -1, 0, 0, -2, 2, 0, 0, 1});
  expect_weights(weights_of("hexahedron:2"), {0, 1, -1, 0, 0, -2, 2, 0, 0, 1});
  expect_weights(weights_of("hexahedron:3"), {1, -1, 1, -1, -2, 2, -2, 2, 1, -1, 1});
}

}  // namespace
}  // namespace maille::testing
