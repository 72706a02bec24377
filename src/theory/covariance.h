#pragma once

#include <maille/predict.h>

#include <vector>

#include "theory/matrix.h"

namespace maille {

/// Which derivative: how often along each axis.
using MultiIndex = std::vector<unsigned>;

/// All derivatives of one order in one dimension or more, in lexicographic order, highest first.
std::vector<MultiIndex> derivatives_of_order(unsigned dimension, unsigned order);

/// Products of the factorials: i! j! ... .
double factorial(const MultiIndex& index);

/// Covariance of the derivatives of one order, up to a common factor.
Matrix covariance_of(Covariance model, const std::vector<MultiIndex>& derivatives);

}  // namespace maille
