#include "theory/covariance.h"

namespace maille {

namespace {

void append_derivatives(MultiIndex& index, unsigned axis, unsigned left, std::vector<MultiIndex>& all) {
  if (axis + 1 == index.size()) {
    index[axis] = left;
    all.push_back(index);
    return;
  }
  for (unsigned times = left + 1; times-- > 0;) {
    index[axis] = times;
    append_derivatives(index, axis + 1, left - times, all);
  }
}

/// Moments of the normal distribution, (n - 1)!! for even n: 1, 0, 1, 0, 3, 0, 15, ... They are derivatives
/// of its covariance function at 0, up to sign.
double normal_moment(unsigned n) {
  if (n % 2 == 1) return 0;
  double moment = 1;
  for (unsigned k = 3; k < n; k += 2) moment *= k;
  return moment;
}

/// The covariance exp(-r^2 / 2) is a product over the axes, so that of derivatives is one, too. Within one
/// order the signs are alike.
double gaussian_covariance(const MultiIndex& a, const MultiIndex& b) {
  double covariance = 1;
  for (size_t axis = 0; axis < a.size(); ++axis) covariance *= normal_moment(a[axis] + b[axis]);
  return covariance;
}

}  // namespace

std::vector<MultiIndex> derivatives_of_order(unsigned dimension, unsigned order) {
  std::vector<MultiIndex> all;
  MultiIndex index(dimension);
  append_derivatives(index, 0, order, all);
  return all;
}

double factorial(const MultiIndex& index) {
  double result = 1;
  for (const unsigned times : index) {
    for (unsigned k = 2; k <= times; ++k) result *= k;
  }
  return result;
}

/// The three models of docs/prediction.md, "From smoothness to weights": alike, i! j! on the diagonal, and an
/// isotropic Gaussian field.
Matrix covariance_of(Covariance model, const std::vector<MultiIndex>& derivatives) {
  Matrix result = Matrix::identity(derivatives.size());
  for (size_t i = 0; i < derivatives.size(); ++i) {
    if (model == Covariance::rotation) result(i, i) = factorial(derivatives[i]);
    if (model != Covariance::gaussian) continue;
    for (size_t j = 0; j < derivatives.size(); ++j) {
      result(i, j) = gaussian_covariance(derivatives[i], derivatives[j]);
    }
  }
  return result;
}

}  // namespace maille
