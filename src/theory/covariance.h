#pragma once

#include <maille/predict.h>

#include <vector>

#include "theory/matrix.h"

namespace maille {

/// Which derivative: how often along each axis.
using MultiIndex = std::vector<unsigned>;

/// All derivatives of one order in one dimension or more, in lexicographic order, highest first: in two
/// dimensions (2 0), (1 1), (0 2).
std::vector<MultiIndex> derivatives_of_order(unsigned dimension, unsigned order);

/// Products of the factorials: i! j! ... .
double factorial(const MultiIndex& index);

/// Covariance of the derivatives of one order, up to a common factor, which no weight depends on. Positive
/// definite.
Matrix covariance_of(Covariance model, const std::vector<MultiIndex>& derivatives);

}  // namespace maille
