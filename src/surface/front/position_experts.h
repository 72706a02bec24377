#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "base/lanes.h"
#include "entropy/mixing.h"
#include "surface/front/position_codes.h"
#include "surface/front/position_predictor.h"
#include "surface/vector3.h"

namespace maille {

/// The number that is coded next.
struct PositionNumber {
  const PositionPrediction* prediction = nullptr;
  uint32_t point = 0;
  uint32_t newest = none;  ///< the point before
  unsigned axis = 0;
  unsigned place = 0;  ///< of the axis among those of the point
};

/// The experts of docs/format.md, 14.6, each with a mean and a scale for the number at hand: they say how
/// probable both sides of a decision are. Doubles and floats in a fixed order of + - * / and sqrt.
class PositionExperts {
 public:
  static constexpr unsigned count = PositionPrediction::experts;
  static constexpr unsigned scale_bins = 48;  ///< half octaves of the deviation, from 2^-3 to 2^20 units

  PositionExperts() {
    for (auto& expert : scales_) expert.fill(1.0F);
  }

  void begin_point() { residual_.fill({}); }
  /// Means and scales, given the numbers of this point that are known.
  void begin_number(const PositionNumber& number) {
    condition(number);
    set_up(*number.prediction);
  }
  /// Decisions follow, near this value.
  void begin_decisions(double base) {
    base_ = base;
    for (unsigned j = 0; j < count; ++j) {
      const double relative = mean_[j] - base_;
      relative_mean_[j] = static_cast<float>(relative > -1e32 ? relative < 1e32 ? relative : 1e32 : -1e32);
    }
  }
  /// Of what lies below a boundary, by each expert, in 1/2^30.
  [[gnu::always_inline]] SignedLanes share_below(double boundary) const {
    const auto where = static_cast<float>(boundary - base_);
    constexpr auto most = static_cast<float>(largest_deviation);
    const FloatLanes deviation =
        clamp_lanes((where - relative_mean_) * inverse_scale_, FloatLanes{} - most, FloatLanes{} + most);
    // Clamped before, so that the conversion is defined.
    const SignedLanes place = __builtin_convertvector(deviation, SignedLanes);
    return SignedLanes{distribution(place[0]), distribution(place[1]), distribution(place[2]),
                       distribution(place[3])};
  }
  /// What an expert says is the ratio of what its distribution has above and below, within the interval that
  /// is left; at least 1 each, as its logarithm is taken.
  [[gnu::always_inline]] SignedLanes logits(SignedLanes between) const {
    const SignedLanes above = high_ - between;
    const SignedLanes below = between - low_;
    return logit_of_ratio(above > 1 ? above : SignedLanes{} + 1, below > 1 ? below : SignedLanes{} + 1);
  }
  /// The interval shrinks to one side.
  [[gnu::always_inline]] void narrow(bool above, SignedLanes between) {
    if (above) {
      low_ = between;
    } else {
      high_ = between;
    }
  }
  /// The number turned out to be this.
  void learn(const PositionNumber& number, double where) {
    learn_scales(where);
    for (unsigned j = 0; j < count; ++j)
      residual_[j][number.axis] = where - number.prediction->mean[j][number.axis];
  }

  double mean(unsigned j) const { return mean_[j]; }
  /// Of the last expert, which is the best one.
  double expected() const { return mean_[count - 1]; }
  double scale() const { return scale_; }
  /// As decisions have it: a float from the base on.
  double rounded_mean(unsigned j) const { return static_cast<double>(relative_mean_[j]) + base_; }
  double deviation() const { return deviation_; }
  unsigned scale_bin() const { return scale_bin_; }
  unsigned spread_bin() const { return spread_bin_; }
  unsigned edge_bin() const { return edge_bin_; }

 private:
  static constexpr unsigned scale_kinds = 16;

  /// Mean and variance of this axis given the axes coded before it: the formula of conditional normal
  /// distributions (mean + S_ab S_bb^-1 (b - mean b), S_aa - S_ab S_bb^-1 S_ba), with the 1 x 1 and 2 x 2
  /// cases written out. If the axes before are almost dependent, the determinant is rounding error and they
  /// are not used.
  void condition(const PositionNumber& number) {
    const unsigned axis = number.axis;
    const auto& s = number.prediction->covariance;
    const auto& axes = number.prediction->axes;
    double variance = s[axis][axis];
    std::array<double, 2> factor = {};
    if (number.place == 1) {
      factor[0] = s[axis][axes[0]] / s[axes[0]][axes[0]];
      variance -= factor[0] * s[axis][axes[0]];
    } else if (number.place == 2) {
      const double aa = s[axes[0]][axes[0]];
      const double bb = s[axes[1]][axes[1]];
      const double ab = s[axes[0]][axes[1]];
      const double determinant = aa * bb - ab * ab;
      if (determinant > 1e-9 * aa * bb) {
        const double ca = s[axis][axes[0]];
        const double cb = s[axis][axes[1]];
        factor[0] = (ca * bb - cb * ab) / determinant;
        factor[1] = (cb * aa - ca * ab) / determinant;
        variance -= factor[0] * ca + factor[1] * cb;
      }
    }
    // Rounding to whole units alone has a variance of 1/12; an estimate below 0.03 says more than can be
    // known.
    deviation_ = std::sqrt(variance > 0.03 ? variance : 0.03);
    for (unsigned j = 0; j < count; ++j) {
      double mean = number.prediction->mean[j][axis];
      for (unsigned i = 0; i < number.place; ++i) mean += factor[i] * residual_[j][axes[i]];
      mean_[j] = mean;
    }
  }

  void set_up(const PositionPrediction& p) {
    const double inverse = 1 / deviation_;
    scale_bin_ = clamp_bin(half_octave(deviation_), -6, scale_bins);
    spread_bin_ = clamp_bin(half_octave(p.spread * inverse), -3, 8);
    edge_bin_ = clamp_bin(half_octave(p.edge), 0, 32);
    const unsigned apart = clamp_bin(half_octave(p.disagreement * inverse), -4, 8);
    kind_ = {(p.valence_class >> 1) * 4 + (p.parallelogram_class > 0 ? p.parallelogram_class - 1 : 0),
             spread_bin_, p.valence_class, apart + 8 * (edge_bin_ > 12)};
    for (unsigned j = 0; j < count; ++j) {
      const double ratio = static_cast<double>(scales_[j][scale_place(j)]);
      // A logistic distribution has the standard deviation pi / sqrt(3) = 1.81 times its scale: 0.55 is its
      // inverse.
      const double scale = 0.55 * deviation_ * ratio;
      // distribution() takes 4096ths of a scale.
      inverse_scale_[j] = static_cast<float>(4096 / (scale > 0.01 ? scale : 0.01));
      if (j == count - 1) scale_ = scale > 0.01 ? scale : 0.01;
    }
    low_ = SignedLanes{};
    high_ = SignedLanes{} + (1 << 30);
  }
  /// Each expert has ratios by another property of the place, so that they are wrong at different places.
  unsigned scale_place(unsigned j) const { return scale_bin_ * scale_kinds + kind_[j]; }

  // The mean of |error| / deviation of each expert, of about the last 33 numbers of this kind: 0.03 a step.
  // Errors beyond 20 deviations are edges, and count as 20. Both are in the format (14.7); not swept.
  void learn_scales(double where) {
    const double inverse = 1 / deviation_;
    for (unsigned j = 0; j < count; ++j) {
      double ratio = std::fabs(where - mean_[j]) * inverse;
      ratio = ratio < 20 ? ratio : 20;
      float& scale = scales_[j][scale_place(j)];
      scale += 0.03F * (static_cast<float>(ratio) - scale);
    }
  }

  std::array<std::array<float, scale_bins * scale_kinds>, count> scales_;
  std::array<Vector3, count> residual_;  // of the point at hand
  // Of the number at hand.
  double deviation_ = 1;
  double scale_ = 1;
  unsigned scale_bin_ = 0;
  unsigned spread_bin_ = 0;
  unsigned edge_bin_ = 0;
  std::array<unsigned, count> kind_;
  std::array<double, count> mean_;
  double base_ = 0;  // means are kept relative to this, in floats
  FloatLanes relative_mean_;
  FloatLanes inverse_scale_;
  SignedLanes low_;  // distribution functions at the ends of the interval
  SignedLanes high_;
};

}  // namespace maille
