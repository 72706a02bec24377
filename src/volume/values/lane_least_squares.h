#pragma once

#include <array>

#include "code/symmetric_solver.h"
#include "volume/values/value_lanes.h"

namespace maille {

/// Weights that would have predicted the numbers of the past best from N features each, for each lane on its
/// own: normal equations whose samples fade away, solved again now and then. As OnlineLeastSquares, but
/// components lie side by side, so that a sample of three costs what one does. + - * / in a fixed order; what
/// is out of all range is not learnt.
/// Products are summed in floats and solved in doubles, with a ridge.
template <unsigned Width, unsigned N>
class LaneLeastSquares {
 public:
  using Doubles = typename ValueLanes<Width>::Doubles;
  using Longs = typename ValueLanes<Width>::Longs;
  using Floats = typename ValueLanes<Width>::Floats;
  using Ints = typename ValueLanes<Width>::Ints;
  using Features = std::array<Floats, N>;

  const Features& weights() const { return weights_; }

  /// `certainty` weighs the sample: 1 / its expected error, or 0.
  void learn(const Features& features, const Floats& target, const Floats& certainty) {
    // Newer samples weigh more instead of older ones less.
    const Floats weight = certainty * gain_;
    const Floats scaled_target = target * weight;
    Ints sane = (scaled_target < largest) & (-scaled_target < largest);
    Features scaled;
    for (unsigned i = 0; i < N; ++i) {
      scaled[i] = features[i] * weight;
      sane &= (scaled[i] < largest) & (-scaled[i] < largest);
    }
    const Floats none = {};
    for (unsigned i = 0; i < N; ++i) scaled[i] = sane ? scaled[i] : none;
    const Floats sane_target = sane ? scaled_target : none;
    unsigned at = 0;
    for (unsigned i = 0; i < N; ++i) {
      for (unsigned j = 0; j <= i; ++j) products_[at++] += scaled[i] * scaled[j];
      targets_[i] += scaled[i] * sane_target;
    }
    gain_ *= growth;
    if (gain_ > 1024) fade();
    if (++samples_ % interval == 0) solve();
  }

 private:
  // Products of two such numbers, summed over some thousand samples, stay far below the largest float.
  static constexpr float largest = 1e6F;
  // A sample counts for 1/e after 2,500 others. Chosen with the first versions (1d8c690, 3b57236), no sweep
  // is on record.
  static constexpr float growth = 1.0002F;  // of the root: samples fade by .9996
  static constexpr unsigned interval = 32;

  /// Keeps the growing weights within range, by a power of two, which rounds nothing.
  void fade() {
    constexpr float factor = 1.0F / (1024.0F * 1024.0F);
    for (Floats& each : products_) each *= factor;
    for (Floats& each : targets_) each *= factor;
    gain_ *= 1.0F / 1024.0F;
  }

  /// Solves with a little added to the diagonal, which keeps weights of features that do not vary near 0. The
  /// floor is in units of the samples' own weights. Lanes without solution, or with weights beyond any use,
  /// keep what they had.
  void solve() {
    std::array<Doubles, N * N> rows;
    std::array<Doubles, N> x;
    const double floor = 1e-3 * static_cast<double>(gain_) * static_cast<double>(gain_);
    for (unsigned i = 0, at = 0; i < N; ++i) {
      for (unsigned j = 0; j <= i; ++j) rows[i * N + j] = __builtin_convertvector(products_[at++], Doubles);
      rows[i * N + i] += 1e-4 * rows[i * N + i] + floor;
      x[i] = __builtin_convertvector(targets_[i], Doubles);
    }
    Longs good;
    solve_symmetric(rows.data(), N, x.data(), 1e-12, good);
    for (const Doubles& weight : x) good &= (weight < 1e4) & (weight > -1e4);
    const Ints keep = __builtin_convertvector(good, Ints);
    for (unsigned i = 0; i < N; ++i) {
      const Floats weight = __builtin_convertvector(x[i], Floats);
      weights_[i] = keep ? weight : weights_[i];
    }
  }

  std::array<Floats, N*(N + 1) / 2> products_ = {};  ///< the lower triangle, row by row
  Features targets_ = {};
  Features weights_ = {};
  float gain_ = 1;
  unsigned samples_ = 0;
};

}  // namespace maille
