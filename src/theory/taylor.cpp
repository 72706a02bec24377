#include "theory/taylor.h"

#include <algorithm>
#include <cmath>

#include "theory/covariance.h"

namespace maille {

namespace {

// Of singular values, relative to the rows: far above rounding (1e-16), far below what stencils have. Chosen,
// not swept.
constexpr double relative_cutoff = 1e-11;

/// Rows whose squared length is the expected squared error due to derivatives of one order: with covariance L
/// L^T and errors c in each, c^T L L^T c = |L^T c|^2.
Matrix error_rows(const Stencil& stencil, Covariance model, unsigned order) {
  const Matrix covariance = covariance_of(model, derivatives_of_order(stencil.dimension, order));
  return product(transposed(cholesky(covariance)), taylor_rows(stencil, order));
}

/// What these rows must give for a prediction without error: the value itself for order 0, else nothing.
Matrix wanted(const Matrix& rows, unsigned order) {
  Matrix result(rows.rows(), 1);
  if (order == 0) result(0, 0) = 1;
  return result;
}

/// All weights that are as good as one another so far: `weights` plus anything in `freedom`. At first all
/// weights are.
struct Candidates {
  Matrix weights;
  Matrix freedom;

  /// Keeps those with the smallest |rows x - b|.
  void narrow(const Matrix& rows, const Matrix& b) {
    const LeastSquares solved = least_squares(product(rows, freedom), difference(b, product(rows, weights)),
                                              relative_cutoff * norm(rows));
    weights = sum(weights, product(freedom, solved.shortest));
    freedom = product(freedom, solved.null_space);
  }
};

void append_rows(Matrix& rows, const Matrix& more) {
  Matrix result(rows.rows() + more.rows(), more.columns());
  for (size_t j = 0; j < more.columns(); ++j) {
    for (size_t i = 0; i < rows.rows(); ++i) result(i, j) = rows(i, j);
    for (size_t i = 0; i < more.rows(); ++i) result(rows.rows() + i, j) = more(i, j);
  }
  rows = result;
}

/// Orders above the exact ones and the noise together; one minimum, since the noise counts every weight.
void weigh_noise(const Stencil& stencil, const PredictionRule& rule, Candidates& candidates) {
  Matrix rows(0, stencil.known.size());
  for (unsigned order = rule.exact_order + 1; order <= rule.order; ++order) {
    append_rows(rows, error_rows(stencil, rule.covariance, order));
  }
  Matrix noise = Matrix::identity(stencil.known.size());
  for (size_t i = 0; i < noise.rows(); ++i) noise(i, i) = std::sqrt(rule.noise);
  append_rows(rows, noise);
  candidates.narrow(rows, Matrix(rows.rows(), 1));
}

}  // namespace

Matrix taylor_rows(const Stencil& stencil, unsigned order) {
  const std::vector<MultiIndex> derivatives = derivatives_of_order(stencil.dimension, order);
  Matrix rows(derivatives.size(), stencil.known.size());
  for (size_t k = 0; k < stencil.known.size(); ++k) {
    for (size_t i = 0; i < derivatives.size(); ++i) {
      double monomial = 1;
      for (unsigned axis = 0; axis < stencil.dimension; ++axis) {
        const double distance = stencil.known[k].position[axis] - stencil.target[axis];
        for (unsigned times = 0; times < derivatives[i][axis]; ++times) monomial *= distance;
      }
      rows(i, k) = monomial / factorial(derivatives[i]);
    }
  }
  return rows;
}

/// The flat limit of docs/prediction.md, "From smoothness to weights": each order decides in what those
/// before left free.
std::vector<double> taylor_weights(const Stencil& stencil, const PredictionRule& rule) {
  const size_t count = stencil.known.size();
  Candidates candidates{Matrix(count, 1), Matrix::identity(count)};
  const unsigned last = rule.noise > 0 ? std::min(rule.exact_order, rule.order) : rule.order;
  for (unsigned order = 0; order <= last && candidates.freedom.columns() > 0; ++order) {
    const Matrix rows = error_rows(stencil, rule.covariance, order);
    candidates.narrow(rows, wanted(rows, order));
  }
  if (rule.noise > 0 && candidates.freedom.columns() > 0) weigh_noise(stencil, rule, candidates);
  std::vector<double> weights(count);
  for (size_t k = 0; k < count; ++k) weights[k] = candidates.weights(k, 0);
  return weights;
}

int exactness_of(const Stencil& stencil, const std::vector<double>& weights) {
  double largest = 1;
  for (const double weight : weights) largest = std::max(largest, std::fabs(weight));
  for (unsigned order = 0; order <= largest_taylor_order; ++order) {
    const Matrix rows = taylor_rows(stencil, order);
    for (size_t i = 0; i < rows.rows(); ++i) {
      double error = order == 0 ? -1 : 0;
      double size = 0;
      for (size_t k = 0; k < weights.size(); ++k) {
        error += weights[k] * rows(i, k);
        size = std::max(size, std::fabs(rows(i, k)));
      }
      // Relative to what is summed, as weights far from 1 carry more rounding.
      if (std::fabs(error) > 1e-9 * size * largest) return static_cast<int>(order) - 1;
    }
  }
  return static_cast<int>(largest_taylor_order);
}

}  // namespace maille
