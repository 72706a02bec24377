#pragma once

#include <gtest/gtest.h>
#include <maille/predict.h>

#include <string>
#include <vector>

namespace maille::testing {

/// Weights of a named stencil, by its usual rule.
inline Prediction usual_prediction(const std::string& name) {
  const auto named = named_stencil(name);
  EXPECT_TRUE(named) << named.error().message;
  return *predict(named->stencil, named->rule);
}

inline std::vector<double> weights_of(const std::string& name, const PredictionRule& rule) {
  const auto named = named_stencil(name);
  EXPECT_TRUE(named) << named.error().message;
  const auto prediction = predict(named->stencil, rule);
  EXPECT_TRUE(prediction) << prediction.error().message;
  return prediction->weights;
}

inline std::vector<double> weights_of(const std::string& name) {
  return usual_prediction(name).weights;
}

inline PredictionRule taylor_rule(Covariance covariance, unsigned order = largest_taylor_order) {
  PredictionRule rule;
  rule.covariance = covariance;
  rule.order = order;
  return rule;
}

inline PredictionRule spectral_rule() {
  PredictionRule rule;
  rule.kind = PredictionRule::Kind::spectral;
  return rule;
}

inline PredictionRule noise_rule(Covariance covariance, double noise, unsigned order = 2) {
  PredictionRule rule = taylor_rule(covariance, order);
  rule.noise = noise;
  return rule;
}

inline void expect_weights(const std::vector<double>& actual, const std::vector<double>& expected,
                           double tolerance = 1e-12) {
  ASSERT_EQ(actual.size(), expected.size());
  for (size_t i = 0; i < actual.size(); ++i) EXPECT_NEAR(actual[i], expected[i], tolerance) << "sample " << i;
}

inline constexpr Covariance all_covariances[] = {Covariance::independent, Covariance::rotation,
                                                 Covariance::gaussian};

}  // namespace maille::testing
