#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "theory/taylor.h"
#include "theory/testing.h"

namespace maille::testing {
namespace {

using ::testing::HasSubstr;

Stencil arbitrary_stencil(unsigned dimension, size_t samples) {
  Stencil stencil;
  stencil.dimension = dimension;
  const auto position = [&] {
    std::vector<double> coordinates;
    for (unsigned axis = 0; axis < dimension; ++axis)
      coordinates.push_back(*rc::gen::inRange(-30, 31) / 10.0);
    return coordinates;
  };
  stencil.target = position();
  for (size_t i = 0; i < samples; ++i) stencil.known.push_back({"", position()});
  return stencil;
}

double sum_of(const std::vector<double>& weights) {
  double sum = 0;
  for (const double weight : weights) sum += weight;
  return sum;
}

RC_GTEST_PROP(Predict, ConstantsComeBackFromAnyStencil, ()) {
  const auto dimension = *rc::gen::inRange(1u, 4u);
  const Stencil stencil = arbitrary_stencil(dimension, *rc::gen::inRange<size_t>(1, 9));
  PredictionRule rule = taylor_rule(
      *rc::gen::elementOf(std::vector<Covariance>(std::begin(all_covariances), std::end(all_covariances))),
      *rc::gen::inRange(0u, 6u));
  rule.noise = *rc::gen::element(0.0, 0.3, 7.0);
  const auto prediction = predict(stencil, rule);
  RC_ASSERT(prediction);
  RC_ASSERT(std::fabs(sum_of(prediction->weights) - 1) < 1e-8);
  RC_ASSERT(prediction->exactness >= 0);
}

RC_GTEST_PROP(Predict, EnoughSamplesGiveWhatThePolynomialsSay, ()) {
  // 6 samples in general position settle order 2; lattice points of random shears are.
  Stencil stencil;
  const double a = *rc::gen::inRange(-20, 21) / 10.0, b = *rc::gen::inRange(-20, 21) / 10.0;
  for (const auto& [i, j] : {std::pair{0, 0}, {1, 0}, {2, 0}, {0, 1}, {1, 1}, {0, 2}}) {
    stencil.known.push_back({"", {i + a * j, double(j)}});
  }
  stencil.target = {b, a};
  const auto prediction = predict(stencil, taylor_rule(Covariance::rotation));
  RC_ASSERT(prediction->exactness >= 2);
  double predicted = 0;
  const auto quadric = [](double u, double v) { return 2 - u + 3 * v + u * u - 4 * u * v + 5 * v * v; };
  for (size_t i = 0; i < 6; ++i) {
    predicted += prediction->weights[i] * quadric(stencil.known[i].position[0], stencil.known[i].position[1]);
  }
  RC_ASSERT(std::fabs(predicted - quadric(b, a)) < 1e-6);
}

/// Turned by an angle, and scaled.
Stencil turned(Stencil stencil, double angle, double scale) {
  const auto turn = [&](std::vector<double>& p) {
    p = {scale * (std::cos(angle) * p[0] - std::sin(angle) * p[1]),
         scale * (std::sin(angle) * p[0] + std::cos(angle) * p[1])};
  };
  turn(stencil.target);
  for (auto& sample : stencil.known) turn(sample.position);
  return stencil;
}

RC_GTEST_PROP(Predict, IsTheSameInEveryDirection, ()) {
  const std::string name = *rc::gen::elementOf(
      std::vector<std::string>{"dual-parallelogram:6", "dual-parallelogram:7", "k-star:5",
                               "polygon-beside:4:6", "butterfly", "sqrt3", "polygon:7:3"});
  const double angle = *rc::gen::inRange(0, 628) / 100.0;
  const Stencil stencil = named_stencil(name)->stencil;
  for (const Covariance covariance : {Covariance::rotation, Covariance::gaussian}) {
    const PredictionRule rule = taylor_rule(covariance);
    expect_weights(predict(turned(stencil, angle, 1), rule)->weights, predict(stencil, rule)->weights, 1e-9);
    // In the limit of small noise, size does not matter, either.
    expect_weights(predict(turned(stencil, angle, .25), rule)->weights, predict(stencil, rule)->weights,
                   1e-8);
    const PredictionRule noisy = noise_rule(covariance, .5);
    expect_weights(predict(turned(stencil, angle, 1), noisy)->weights, predict(stencil, noisy)->weights,
                   1e-9);
  }
}

TEST(Predict, IndependentDerivativesDependOnTheAxes) {
  const Stencil stencil = named_stencil("polygon-beside:4:6")->stencil;
  const PredictionRule rule = taylor_rule(Covariance::independent);
  EXPECT_GT(std::fabs(predict(turned(stencil, .3, 1), rule)->weights[0] - predict(stencil, rule)->weights[0]),
            1e-3);
}

TEST(Predict, LittleNoiseIsTheLimitAndMuchNoiseTheSmallestGain) {
  for (const char* name : {"dual-parallelogram:6", "k-star:7", "polygon-beside:4:6"}) {
    // Above order 2 the limit looks further than the finite version does.
    expect_weights(weights_of(name, noise_rule(Covariance::gaussian, 1e-9)),
                   weights_of(name, taylor_rule(Covariance::gaussian, 2)), 1e-6);
    expect_weights(weights_of(name, noise_rule(Covariance::gaussian, 1e9)),
                   weights_of(name, taylor_rule(Covariance::gaussian, 1)), 1e-6);
  }
}

TEST(Predict, NoiseGainFallsWithNoiseAllowedFor) {
  const Stencil stencil = named_stencil("dual-parallelogram:6")->stencil;
  double before = 1e9;
  for (const double noise : {0.0, .1, .5, 2.0, 10.0}) {
    const double gain = predict(stencil, noise_rule(Covariance::gaussian, noise))->noise_gain;
    EXPECT_LT(gain, before);
    before = gain;
  }
}

TEST(Predict, ExactnessIsTheDegreeOfPolynomials) {
  EXPECT_EQ(usual_prediction("cube:0x02").exactness, 0);
  EXPECT_EQ(usual_prediction("cube:0xfe").exactness, 2);  // all but xyz, which is of degree 3
  EXPECT_EQ(usual_prediction("k-star:6").exactness, 3);
  EXPECT_EQ(usual_prediction("k-star:5").exactness, 3);
  EXPECT_EQ(usual_prediction("cube:0").exactness, -1);
}

TEST(Predict, DuplicatesShareTheirWeight) {
  Stencil stencil;
  stencil.target = {1, 0};
  stencil.known = {{"", {0, 0}}, {"", {.5, 0}}, {"", {.5, 0}}};
  expect_weights(predict(stencil, {})->weights, {-1, 1, 1}, 1e-12);
}

std::string complaint(const Stencil& stencil, const PredictionRule& rule = {}) {
  const auto prediction = predict(stencil, rule);
  return prediction ? "none" : prediction.error().message;
}

TEST(Predict, SaysWhatIsWrongWithAStencil) {
  Stencil stencil = named_stencil("butterfly")->stencil;
  EXPECT_EQ(complaint(stencil), "none");
  EXPECT_THAT(complaint(stencil, spectral_rule()), HasSubstr("needs the edges"));
  EXPECT_THAT(complaint(stencil, taylor_rule(Covariance::rotation, 25)), HasSubstr("orders go up to 24"));
  EXPECT_THAT(complaint(stencil, noise_rule(Covariance::rotation, -1)), HasSubstr("variance of noise"));
  EXPECT_THAT(complaint(stencil, noise_rule(Covariance::rotation, NAN)), HasSubstr("variance of noise"));
  stencil.edges = {{0, 9}};
  EXPECT_THAT(complaint(stencil), HasSubstr("samples 0 and 9 of 9"));
  stencil.edges.clear();
  stencil.known[3].position = {1, 2, 3};
  EXPECT_THAT(complaint(stencil), HasSubstr("known sample 3 has 3 coordinates instead of 2"));
  stencil.known[3].position = {NAN, 0};
  EXPECT_THAT(complaint(stencil), HasSubstr("too far away"));
  stencil.known.resize(100, stencil.known[0]);
  EXPECT_THAT(complaint(stencil), HasSubstr("at most 64 samples"));
  stencil.dimension = 0;
  EXPECT_THAT(complaint(stencil), HasSubstr("1 to 3 dimensions"));
}

TEST(NamedStencils, AllFamiliesHaveAnExampleThatCanBePredicted) {
  const char* examples[] = {"parallelogram",         "quad",          "dual-parallelogram:16",
                            "k-star:16:equilateral", "polygon:16:15", "polygon-beside:16:16:13",
                            "grid:##/##|##/#x",      "butterfly",     "butterfly-10",
                            "modified-butterfly:16", "sqrt3",         "sqrt3-small",
                            "sqrt3-ring:16",         "cube:254",      "hexahedron:3"};
  ASSERT_EQ(std::size(examples), stencil_families().size());
  for (size_t i = 0; i < std::size(examples); ++i) {
    EXPECT_EQ(std::string(examples[i]).find(stencil_families()[i].name), 0u);
    EXPECT_NEAR(sum_of(weights_of(examples[i])), 1, 1e-9) << examples[i];
  }
}

std::string name_complaint(const std::string& name) {
  const auto named = named_stencil(name);
  return named ? "none" : named.error().message;
}

TEST(NamedStencils, SayWhatIsWrongWithAName) {
  EXPECT_THAT(name_complaint("buterfly"), HasSubstr("no stencil 'buterfly'; known are parallelogram, "));
  EXPECT_THAT(name_complaint("k-star"), HasSubstr("k-star:K[:reflected|equilateral|DISTANCE]"));
  EXPECT_THAT(name_complaint("butterfly:8"), HasSubstr("does not have the parameters"));
  EXPECT_THAT(name_complaint("k-star:17"), HasSubstr("K is a number from 3 to 16, not '17'"));
  EXPECT_THAT(name_complaint("k-star:6:far"), HasSubstr("reflected, equilateral or a distance"));
  for (const char* tips : {"11", "0.01", "1.7x", "1..7", ".", "-1", "nan", "1e1", ""}) {
    EXPECT_THAT(name_complaint(std::string("k-star:6:") + tips), HasSubstr("or a distance")) << tips;
  }
  EXPECT_THAT(name_complaint("polygon:5:5"), HasSubstr("from 1 to 4"));
  EXPECT_THAT(name_complaint("cube:0x03"), HasSubstr("bit 0"));
  EXPECT_THAT(name_complaint("cube:0x"), HasSubstr("not '0x'"));
  EXPECT_THAT(name_complaint("grid:##/##"), HasSubstr("no x"));
  EXPECT_THAT(name_complaint("grid:#o/#x"), HasSubstr("not 'o'"));
  EXPECT_THAT(name_complaint(""), HasSubstr("no stencil ''"));
}

TEST(NamedStencils, SpectralRulesKnowTheirGraphs) {
  // Every quad of the grid and of the polygon is the same stencil.
  expect_weights(weights_of("grid:##/x#", spectral_rule()), {1, -1, 1});
  expect_weights(weights_of("polygon:4:3", spectral_rule()), {1, -1, 1});
  expect_weights(weights_of("quad", spectral_rule()), {1, -1, 1});
  // A ring is symmetric whatever the graph.
  const auto star = weights_of("k-star:6", spectral_rule());
  for (unsigned i = 1; i < 6; ++i) {
    EXPECT_NEAR(star[i], star[0], 1e-12);
    EXPECT_NEAR(star[6 + i], star[6], 1e-12);
  }
}

}  // namespace
}  // namespace maille::testing
