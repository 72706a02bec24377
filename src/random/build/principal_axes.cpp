#include "random/build/principal_axes.h"

#include <algorithm>
#include <cmath>

namespace maille {
namespace {

using Matrix = std::array<std::array<double, 3>, 3>;

/// Not divided by the number of places, which would not change the axes.
Matrix covariance(const SpatialGraph& graph) {
  std::array<double, 3> mean{};
  for (const auto& place : graph.place) {
    for (unsigned k = 0; k < 3; ++k) mean[k] += static_cast<double>(place[k]);
  }
  for (double& m : mean) m /= static_cast<double>(std::max<size_t>(graph.place.size(), 1));
  Matrix sums{};
  for (const auto& place : graph.place) {
    std::array<double, 3> d;
    for (unsigned k = 0; k < 3; ++k) d[k] = static_cast<double>(place[k]) - mean[k];
    for (unsigned i = 0; i < 3; ++i) {
      for (unsigned j = i; j < 3; ++j) sums[i][j] += d[i] * d[j];
    }
  }
  for (unsigned i = 0; i < 3; ++i) {
    for (unsigned j = 0; j < i; ++j) sums[i][j] = sums[j][i];
  }
  return sums;
}

/// One rotation of Jacobi's method: turns `m` and the columns of `axes` so that m[p][q] becomes 0. Of the two
/// angles that do so it takes the one below 45 degrees, with which the method converges (Golub and Van Loan,
/// 8.5). It uses + - * / and sqrt() only, so the axes are the same on every machine.
void rotate(Matrix& m, Matrix& axes, unsigned p, unsigned q) {
  if (m[p][q] == 0) return;
  const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
  const double t = (theta < 0 ? -1.0 : 1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1));
  const double c = 1 / std::sqrt(t * t + 1), s = t * c;
  for (unsigned k = 0; k < 3; ++k) {
    const double a = m[k][p], b = m[k][q];
    m[k][p] = c * a - s * b;
    m[k][q] = s * a + c * b;
  }
  for (unsigned k = 0; k < 3; ++k) {
    const double a = m[p][k], b = m[q][k];
    m[p][k] = c * a - s * b;
    m[q][k] = s * a + c * b;
  }
  for (unsigned k = 0; k < 3; ++k) {
    const double a = axes[k][p], b = axes[k][q];
    axes[k][p] = c * a - s * b;
    axes[k][q] = s * a + c * b;
  }
}

}  // namespace

std::array<std::array<double, 3>, 3> principal_axes(const SpatialGraph& graph) {
  Matrix m = covariance(graph);
  Matrix axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  // Convergence is quadratic: after six sweeps nothing is left of a double.
  for (unsigned sweep = 0; sweep < 8; ++sweep) {
    rotate(m, axes, 0, 1);
    rotate(m, axes, 0, 2);
    rotate(m, axes, 1, 2);
  }
  std::array<unsigned, 3> order = {0, 1, 2};
  // The longest axis first; stable, so that equal ones keep their order.
  std::stable_sort(order.begin(), order.end(), [&](unsigned a, unsigned b) { return m[a][a] > m[b][b]; });
  Matrix sorted;
  for (unsigned i = 0; i < 3; ++i) {
    for (unsigned k = 0; k < 3; ++k) sorted[i][k] = axes[k][order[i]];
  }
  return sorted;
}

}  // namespace maille
