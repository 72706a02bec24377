#pragma once

#include <array>
#include <string>
#include <vector>

#include "triangles.h"

// The second experiment: what a region-growing coder knows when it closes the fan of a vertex.
namespace maille::bench {

/// The last vertex of a fan that is not known yet.
struct FanSample {
  unsigned valence;  ///< of the fan's centre, 5 to 16
  Point target;
  Point focus;                ///< the fan's centre
  std::array<Point, 2> near;  ///< the target's neighbours in the fan
  std::array<Point, 2> far;   ///< those next to them
};

/// Walks over the mesh vertex by vertex, in the order in which they were reached, and completes the fan of
/// each. `reached`: how many vertices were.
std::vector<FanSample> find_fans(const Triangles& mesh, const std::vector<Point>& points, size_t& reached);

/// focus x weight + near[0] + near[1] each x weight + far likewise.
struct FanPredictor {
  std::string name;
  bool one_side = false;  ///< the parallelogram: focus + near[0] - far[0]
  struct Weights {
    double focus, near, far;
  };
  std::array<Weights, 17> weights = {};  ///< by valence
};
std::vector<FanPredictor> fixed_fan_predictors();
/// One for each level of noise in the codecs' tables.
std::vector<FanPredictor> table_fan_predictors();
FanPredictor fitted_fan_predictor(const std::vector<FanSample>& samples);

std::vector<Point> residuals(const std::vector<FanSample>& samples, const FanPredictor& predictor);

}  // namespace maille::bench
