#include <maille/predict.h>

#include <cmath>

#include "base/result.h"
#include "theory/spectral.h"
#include "theory/taylor.h"

namespace maille {

namespace {

// With more the solver would take minutes, and no stencil of a mesh is that large. Jacobi's sweeps are cubic
// in it. Chosen, not swept.
constexpr size_t most_samples = 64;
// Powers of coordinates up to the largest order stay far from what doubles lose; edges are about 1 long.
constexpr double farthest = 100;

Result<> check_position(const Stencil& stencil, const std::vector<double>& position,
                        const std::string& what) {
  if (position.size() != stencil.dimension) {
    return failure(ErrorCode::usage, what + " has " + std::to_string(position.size()) +
                                         " coordinates instead of " + std::to_string(stencil.dimension));
  }
  for (const double x : position) {
    // Refuses NaN as well.
    if (!(std::fabs(x) <= farthest)) {
      return failure(ErrorCode::usage, what +
                                           " lies too far away: edges should be about 1 long, coordinates at "
                                           "most 100");
    }
  }
  return {};
}

Result<> check_samples(const Stencil& stencil, const std::vector<Stencil::Sample>& samples,
                       const std::string& kind) {
  for (size_t i = 0; i < samples.size(); ++i) {
    MAILLE_CHECK(check_position(stencil, samples[i].position, kind + " sample " + std::to_string(i)));
  }
  return {};
}

Result<> check(const Stencil& stencil) {
  if (stencil.dimension < 1 || stencil.dimension > 3) {
    return failure(ErrorCode::usage,
                   "a stencil has 1 to 3 dimensions, not " + std::to_string(stencil.dimension));
  }
  const size_t samples = stencil.known.size() + 1 + stencil.hidden.size();
  if (samples > most_samples) {
    return failure(ErrorCode::usage, "a stencil has at most " + std::to_string(most_samples) +
                                         " samples, not " + std::to_string(samples));
  }
  MAILLE_CHECK(check_position(stencil, stencil.target, "the target"));
  MAILLE_CHECK(check_samples(stencil, stencil.known, "known"));
  MAILLE_CHECK(check_samples(stencil, stencil.hidden, "hidden"));
  for (const auto& [a, b] : stencil.edges) {
    if (a >= samples || b >= samples || a == b) {
      return failure(ErrorCode::usage, "no edge can join samples " + std::to_string(a) + " and " +
                                           std::to_string(b) + " of " + std::to_string(samples));
    }
  }
  return {};
}

Result<> check(const PredictionRule& rule, const Stencil& stencil) {
  if (rule.kind == PredictionRule::Kind::spectral) {
    if (!stencil.edges.empty()) return {};
    return failure(ErrorCode::usage, "the spectral rule needs the edges of the stencil's graph");
  }
  if (rule.order > largest_taylor_order) {
    return failure(ErrorCode::usage, "orders go up to " + std::to_string(largest_taylor_order) + ", not " +
                                         std::to_string(rule.order));
  }
  if (!(rule.noise >= 0 && rule.noise <= 1e12)) {
    return failure(ErrorCode::usage, "the variance of noise is 0 to 1e12, not " + std::to_string(rule.noise));
  }
  return {};
}

}  // namespace

Result<Prediction> predict(const Stencil& stencil, const PredictionRule& rule) {
  MAILLE_CHECK(check(stencil));
  MAILLE_CHECK(check(rule, stencil));
  Prediction prediction;
  prediction.weights =
      rule.kind == PredictionRule::Kind::spectral ? spectral_weights(stencil) : taylor_weights(stencil, rule);
  // Asked of the weights themselves, so that it holds for every rule.
  prediction.exactness = exactness_of(stencil, prediction.weights);
  for (const double weight : prediction.weights) prediction.noise_gain += weight * weight;
  return prediction;
}

}  // namespace maille
