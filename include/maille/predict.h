#pragma once

#include <maille/error.h>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace maille {

/// Values of a smooth function at known places, and a place where the value is wanted. Places are those of a
/// canonical parametrisation, chosen from the connectivity alone: lattice points, regular polygons, regular
/// fans; the unit is the length of an edge.
struct Stencil {
  struct Sample {
    std::string label;             ///< how a table calls it; may be empty
    std::vector<double> position;  ///< `dimension` numbers
  };
  std::string name;
  unsigned dimension = 2;      ///< 1 to 3
  std::vector<double> target;  ///< `dimension` numbers
  std::vector<Sample> known;
  /// Values that are neither known nor wanted. Only the spectral rule looks at them.
  std::vector<Sample> hidden;
  /// The graph of the spectral rule: known samples are 0, 1, ..., then the target, then hidden ones.
  std::vector<std::pair<uint32_t, uint32_t>> edges;
};

/// What the derivatives of one order are taken to be, as random variables with mean 0. docs/prediction.md.
enum class Covariance : uint8_t {
  independent,  ///< all alike; depends on the choice of axes
  rotation,     ///< independent, with the variances that make them the same in every direction
  gaussian,     ///< those of an isotropic Gaussian random field
};

/// Largest order of derivatives that is looked at. Every stencil of up to 40 samples is settled below it.
inline constexpr unsigned largest_taylor_order = 24;

/// How weights follow from a stencil.
struct PredictionRule {
  enum class Kind : uint8_t {
    taylor,    ///< errors in derivatives of low order count infinitely more than those of high order
    spectral,  ///< as little energy as possible in the highest frequencies of the stencil's graph
  };
  Kind kind = Kind::taylor;
  Covariance covariance = Covariance::rotation;
  /// Taylor: derivatives above this order do not count, and what they would decide is decided by the smallest
  /// sum of squared weights.
  unsigned order = largest_taylor_order;
  /// Taylor: variance of the noise in every known value, that of the mixed second derivative being 1. Above
  /// 0, polynomials up to `exact_order` are still reproduced; for orders from there up to `order` the
  /// expected squared error of prediction, noise included, is minimal.
  double noise = 0;
  unsigned exact_order = 1;
};

struct Prediction {
  std::vector<double> weights;  ///< by known sample
  /// Polynomials up to this degree are predicted exactly; -1: not even constants.
  int exactness = -1;
  /// Sum of squared weights: variance of the prediction, for noise of variance 1 in every known value.
  double noise_gain = 0;
};

/// Weights of a stencil. Error: usage, naming what is wrong with the stencil or the rule.
[[nodiscard]] Result<Prediction> predict(const Stencil& stencil, const PredictionRule& rule);

/// A family of stencils known by name, such as "k-star:K:TIPS".
struct StencilFamily {
  std::string name;         ///< up to the first colon
  std::string usage;        ///< with parameters
  std::string description;  ///< one line
};
const std::vector<StencilFamily>& stencil_families();

struct NamedStencil {
  Stencil stencil;
  PredictionRule rule;  ///< by which it is usually meant
};
/// The stencil of a name with its parameters: "butterfly", "k-star:6", "polygon:8:5", "cube:0xfe",
/// "grid:###/##x". Error: usage, saying what is known.
[[nodiscard]] Result<NamedStencil> named_stencil(const std::string& name);

}  // namespace maille
