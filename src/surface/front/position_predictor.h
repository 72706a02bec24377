#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "code/online_least_squares.h"
#include "surface/front/neighbourhood.h"
#include "surface/front/smooth_surface.h"
#include "surface/patch_surface.h"
#include "surface/vector3.h"

namespace maille {

/// What is expected of a position, in units of about the smallest difference that codes can tell.
struct PositionPrediction {
  static constexpr unsigned experts = 4;

  std::array<Vector3, experts> mean;  ///< see PositionPredictor::predict
  Vector3 mean_parallelogram;         ///< mean of a + b - across; where there is none, of neighbours
  Vector3 best_parallelogram;         ///< a + b - across of that with the smallest past errors
  std::array<Vector3, 3> covariance;
  std::array<unsigned, 3> axes;  ///< in the order in which they are coded: the one nearest to the normal last
  double spread = 0;             ///< of the parallelograms
  double edge = 0;               ///< length of the parallelograms' edges
  double disagreement = 0;       ///< between the first expert and all parallelograms
  unsigned parallelogram_class = 0;  ///< number of parallelograms, up to 4
  unsigned valence_class = 0;        ///< 0 to 7
  uint32_t best_a = none;            ///< the best parallelogram, or none
  uint32_t best_b = none;
  uint32_t best_across = none;
};

/// Predicts positions from those known around them, and learns from what they turn out to be: the smoothest
/// surface, triangle angles, online least squares, local variances. Deterministic, and finite for any
/// positions (which it clamps to 1e30). predict() and learn() must alternate, in coded order; docs/format.md,
/// 14.6.
class PositionPredictor {
 public:
  PositionPredictor(const PatchSurface& surface, const VertexRings& rings, uint32_t points);

  /// What is expected at a vertex, from points before it. The reference stays valid until the next call.
  const PositionPrediction& predict(uint32_t vertex);
  /// For points outside the surface: like the one before.
  const PositionPrediction& predict_other();
  /// The position is known now, as the decoder has it; the prediction before was for it.
  void learn(uint32_t point, const Vector3& position);

  const Vector3& position(uint32_t point) const { return positions_[point]; }
  const Neighbourhood& neighbourhood() const { return around_; }

 private:
  static constexpr unsigned features = 12;
  using Weights = std::array<OnlineLeastSquares<features, 256>, 3>;  // by component in the frame

  struct Point {
    Vector3 residual;             // against the last expert
    std::array<float, 3> square;  // of the residual, in the frame of the point
    float error = 0;              // sum of the squares
    float angle = 0;              // of the faces whose three points are known
    uint32_t angles = 0;
    uint32_t faces = 0;
    bool border = false;
  };

  void predict_without_parallelograms();
  void find_tangents(const Vector3& normal, Vector3 ahead);
  void gather();
  void find_frame();
  void find_features();
  Vector3 angle_prediction() const;
  Vector3 smooth_prediction(uint32_t vertex);
  bool angle_tip(const WideParallelogram& parallelogram, Vector3& tip) const;
  double expected_angle(const Point& point) const;
  void find_variance();
  void find_covariance();
  void order_axes();
  Vector3 corrected(const Weights& weights) const;
  void learn_weights(const Vector3& position);
  void learn_angles(uint32_t point);
  unsigned ring_class() const;

  const PatchSurface& surface_;
  SmoothSurface smooth_;
  std::vector<Vector3> positions_;
  std::vector<Point> points_;
  std::vector<Weights> by_ring_;
  std::vector<Weights> by_parallelograms_;
  std::array<std::array<double, 3>, 5> class_square_;
  PositionPrediction result_;
  Neighbourhood around_;
  uint32_t vertex_ = none;
  uint32_t newest_ = none;

  // Of the vertex at hand.
  Vector3 middle_;  // of the parallelograms
  Vector3 mean_edge_;
  Vector3 mean_ring_, mean_across_, mean_tips_, ring_residual_, across_residual_, arc_ends_;
  bool has_tips_ = false;
  std::array<Vector3, 3> frame_;  // normal, across the parallelograms, along them
  std::array<std::array<float, features>, 3> features_;
  std::array<double, 3> variance_;
  Vector3 angle_;
  Vector3 smooth_place_;
  Weights* ring_weights_ = nullptr;
  Weights* parallelogram_weights_ = nullptr;
};

}  // namespace maille
