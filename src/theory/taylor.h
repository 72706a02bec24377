#pragma once

#include <maille/predict.h>

#include <vector>

#include "theory/matrix.h"

namespace maille {

/// Error of a prediction in the derivatives of one order at the target, by sample: row for a derivative,
/// column for a known sample, u^i v^j / i! j!.
Matrix taylor_rows(const Stencil& stencil, unsigned order);

/// Weights by Taylor expansion about the target (docs/prediction.md). The stencil and the rule are valid.
std::vector<double> taylor_weights(const Stencil& stencil, const PredictionRule& rule);

/// Largest degree of polynomials that these weights predict exactly, up to rounding; -1: none.
int exactness_of(const Stencil& stencil, const std::vector<double>& weights);

}  // namespace maille
