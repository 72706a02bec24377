#pragma once

#include <array>
#include <cstddef>

#include "base/lanes.h"
#include "code/symmetric_solver.h"

namespace maille {

/// Weights that would have predicted the numbers of the past best from N features each: normal equations
/// whose samples fade away, solved again now and then. Doubles and floats with + - * / in a fixed order, so
/// both sides have the same weights. What is out of all range is not learnt, so that damaged data cannot
/// bring infinities in.
///
/// `late`: after how many samples weights are solved again, from 1024 on; before that, and where it is 32,
/// after 32. A solution takes N^3 / 6 products, a sample N^2 / 2: for N = 28 solving after each 32 samples is
/// 0.3 of what learning them is.
template <unsigned N, unsigned late = 32>
class OnlineLeastSquares {
 public:
  using Features = std::array<float, N>;

  double predict(const Features& features) const {
    float sum = 0;
    for (unsigned i = 0; i < N; ++i) sum += weights_[i] * features[i];
    return sum;
  }

  /// `certainty` weighs the sample: 1 / its expected error.
  void learn(const Features& features, float target, float certainty) {
    // Newer samples weigh more instead of older ones less.
    const float weight = certainty * gain_;
    const float scaled_target = target * weight;
    bool sane = scaled_target < largest && -scaled_target < largest;
    std::array<FloatLanes, blocks> scaled;
    for (unsigned j = 0; j < blocks; ++j) {
      scaled[j] =
          FloatLanes{features[4 * j], features[4 * j + 1], features[4 * j + 2], features[4 * j + 3]} * weight;
      for (unsigned i = 0; i < 4; ++i) sane = sane && scaled[j][i] < largest && -scaled[j][i] < largest;
    }
    if (!sane) return;
#pragma GCC unroll 16
    for (unsigned i = 0; i < N; ++i) {
      const float factor = scaled[i / 4][i % 4];
      for (unsigned j = 0; j <= i / 4; ++j) products_[i][j] += scaled[j] * factor;
    }
    for (unsigned j = 0; j < blocks; ++j) targets_[j] += scaled[j] * scaled_target;
    gain_ *= growth;
    if (gain_ > 1024) fade();
    ++samples_;
    if (samples_ % interval == 0 && (samples_ < 1024 || samples_ % late == 0)) solve();
  }

 private:
  static_assert(N % 4 == 0, "for the processor's vectors");
  static_assert(late % 32 == 0);
  static constexpr unsigned blocks = N / 4;
  // Products stay below 10^12, and their sums far below the largest float: samples fade.
  static constexpr float largest = 1e6F;
  // So about 2,500 samples count. Chosen without a record of a sweep: more make weights steadier, fewer let
  // them follow a mesh whose parts differ.
  static constexpr float growth = 1.0002F;  // of the root: samples fade by .9996
  static constexpr unsigned interval = 32;

  void fade() {
    // A power of two, so that no bit is lost.
    constexpr float factor = 1.0F / (1024.0F * 1024.0F);
    for (unsigned i = 0; i < N; ++i) {
      for (FloatLanes& block : products_[i]) block *= factor;
    }
    for (FloatLanes& block : targets_) block *= factor;
    gain_ *= 1.0F / 1024.0F;
  }

  /// Solves the normal equations with a little added to the diagonal, a ten-thousandth of it and a thousandth
  /// of a sample of 1, so that features that are equal or all 0 have a solution. Without a solution, or with
  /// weights beyond 10^4, which only equations that say nothing have, the old weights stay.
  void solve() {
    std::array<double, N * N> rows;
    std::array<double, N> x;
    for (unsigned i = 0; i < N; ++i) {
      for (unsigned j = 0; j <= i; ++j) rows[i * N + j] = products_[i][j / 4][j % 4];
      double& diagonal = rows[i * N + i];
      diagonal += 1e-4 * diagonal + 1e-3 * static_cast<double>(gain_) * static_cast<double>(gain_);
      x[i] = targets_[i / 4][i % 4];
    }
    bool solved = false;
    solve_symmetric(rows.data(), N, x.data(), 1e-12, solved);
    if (!solved) return;
    for (unsigned i = 0; i < N; ++i) {
      if (!(x[i] < 1e4 && x[i] > -1e4)) return;
    }
    for (unsigned i = 0; i < N; ++i) weights_[i] = static_cast<float>(x[i]);
  }

  std::array<std::array<FloatLanes, blocks>, N> products_ = {};  // up to the block of the diagonal
  std::array<FloatLanes, blocks> targets_ = {};
  Features weights_ = {};
  float gain_ = 1;
  unsigned samples_ = 0;
};

}  // namespace maille
