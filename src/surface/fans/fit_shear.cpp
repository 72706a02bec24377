#include "surface/fans/fit_shear.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "entropy/static_rans.h"

namespace maille {
namespace {

using Tuple = std::array<double, Shear::most_components>;
using Matrix = std::array<Tuple, Shear::most_components>;
using ComponentOrder = std::array<uint8_t, Shear::most_components>;

/// What parallelograms leave, at vertices that are evenly spread. A shear is for what is badly predicted in
/// several components at once; the better predictions of the real coder are not known yet.
std::vector<Tuple> sample_residuals(const FanSurface& fans, std::span<const int64_t> codes, unsigned n) {
  constexpr uint32_t most = 4096;  // four times as many give the same weights within 2 %
  std::vector<Tuple> residuals;
  const uint32_t step = std::max(1u, fans.vertices / most);
  for (uint32_t v = step; v < fans.vertices; v += step) {
    using R = VertexReferences;
    const auto& at = fans.references[v].at;
    const auto code = [&](uint32_t point, unsigned k) {
      return static_cast<double>(codes[size_t{n} * point + k]);
    };
    Tuple& residual = residuals.emplace_back();
    for (unsigned k = 0; k < n; ++k)
      residual[k] = code(v, k) - (code(at[R::last], k) + code(at[R::focus], k) - code(at[R::before], k));
  }
  return residuals;
}

/// Large residuals, of edges and seams, weigh little: those of smooth places decide. A weight of 1 / (1 +
/// size) turns squares into about absolute values. The variance of rounding, 1/12, keeps the matrix positive
/// definite.
Matrix covariance(const std::vector<Tuple>& residuals, unsigned n) {
  Matrix sum{};
  double weights = 1;
  for (const Tuple& r : residuals) {
    double size = 0;
    for (unsigned k = 0; k < n; ++k) size += std::fabs(r[k]);
    const double weight = 1 / (1 + size);
    weights += weight;
    for (unsigned i = 0; i < n; ++i) {
      for (unsigned j = 0; j < n; ++j) sum[i][j] += weight * r[i] * r[j];
    }
  }
  for (unsigned i = 0; i < n; ++i) {
    for (unsigned j = 0; j < n; ++j) sum[i][j] /= weights;
    sum[i][i] += 1.0 / 12;  // of rounding
  }
  return sum;
}

/// The weights of component `count` given those before it in the order: normal equations of at most three
/// unknowns, by Gauss and Jordan without pivoting, as the matrix is positive definite. Weights of components
/// that follow are 0.
Tuple regress(const Matrix& covariance, const ComponentOrder& order, unsigned count) {
  std::array<std::array<double, Shear::most_components + 1>, Shear::most_components> a{};
  for (unsigned i = 0; i < count; ++i) {
    for (unsigned j = 0; j < count; ++j) a[i][j] = covariance[order[i]][order[j]];
    a[i][count] = covariance[order[i]][order[count]];
  }
  for (unsigned p = 0; p < count; ++p) {
    for (unsigned i = 0; i < count; ++i) {
      const double factor = i == p ? 0 : a[i][p] / a[p][p];
      for (unsigned j = p; j <= count; ++j) a[i][j] -= factor * a[p][j];
    }
  }
  Tuple weights{};
  for (unsigned i = 0; i < count; ++i) weights[i] = a[i][count] / a[i][i];
  return weights;
}

Shear shear_of(const Matrix& covariance, const ComponentOrder& order, unsigned n) {
  std::array<std::array<int32_t, 4>, 4> weights{};
  for (unsigned i = 1; i < n; ++i) {
    const Tuple of = regress(covariance, order, i);
    for (unsigned j = 0; j < i; ++j) {
      // The residual loses what is added to it. The bound is far above weights that occur and within what the
      // format allows (65536); NaN is 0.
      const double weight = std::fabs(of[j]) < 100 ? of[j] * Shear::unit : 0;
      weights[i][j] = static_cast<int32_t>(std::lround(weight));
    }
  }
  return Shear(std::span(order).first(n), weights);
}

/// About the bits of all residuals, times 65536: log2(1 + |residual|) for each.
uint64_t cost_of(const std::vector<Tuple>& residuals, const Shear& shear, unsigned n) {
  uint64_t sum = 0;
  for (const Tuple& r : residuals) {
    std::array<int64_t, Shear::most_components> codes{};
    for (unsigned k = 0; k < n; ++k) codes[k] = static_cast<int64_t>(std::clamp(r[k], -1e12, 1e12));
    shear.apply(codes.data());
    for (unsigned k = 0; k < n; ++k)
      sum += log2_fixed(1 + static_cast<uint32_t>(std::min<int64_t>(std::abs(codes[k]), 0xfffffffe)));
  }
  return sum;
}

}  // namespace

Shear fit_shear(const FanSurface& fans, std::span<const int64_t> codes, unsigned n) {
  const std::vector<Tuple> residuals = sample_residuals(fans, codes, n);
  const Matrix moments = covariance(residuals, n);
  const uint64_t plain = cost_of(residuals, {}, n);
  uint64_t least = plain;
  Shear best;
  ComponentOrder order;
  std::iota(order.begin(), order.end(), uint8_t{0});
  do {
    const Shear shear = shear_of(moments, order, n);
    const uint64_t cost = cost_of(residuals, shear, n);
    if (cost < least) {
      least = cost;
      best = shear;
    }
  } while (std::next_permutation(order.begin(), order.begin() + n));
  // Less than a twentieth of a bit for each vertex never made a file of build/data smaller.
  return 20 * (plain - least) > uint64_t{65536} * residuals.size() ? best : Shear();
}

}  // namespace maille
