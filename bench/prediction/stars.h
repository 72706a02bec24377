#pragma once

#include <array>
#include <string>
#include <vector>

#include "triangles.h"

// The experiment of the thesis: each vertex from its ring and the tips across the ring's edges.
namespace maille::bench {

struct Star {
  uint32_t centre;
  std::vector<uint32_t> ring;  ///< 3 to largest_valence
  std::vector<uint32_t> tips;  ///< tips[i] across the edge from ring[i] to ring[i + 1]
};
inline constexpr unsigned largest_valence = 16;

/// Vertices whose ring is closed and whose tips are all there. With `apart`, only such that no star holds the
/// centre of another: these could be decoded, all at once, from the rest of the mesh.
std::vector<Star> find_stars(const Triangles& mesh, bool apart);

/// Sums over ring and tips, so that a predictor needs two multiplications.
struct StarSample {
  unsigned valence;
  Point centre;
  std::array<double, 3> ring;  ///< mean
  std::array<double, 3> tips;  ///< mean
};
std::vector<StarSample> sample(const std::vector<Star>& stars, const std::vector<Point>& points);

/// alpha x mean of the ring + (1 - alpha) x mean of the tips.
struct StarPredictor {
  std::string name;
  std::array<double, largest_valence + 1> alpha = {};  ///< by valence
};
/// APP, CPM, spectral, Taylor with both kinds of tips: the same for every mesh.
std::vector<StarPredictor> fixed_star_predictors();
/// One for each level of noise and kind of tips in the codecs' tables.
std::vector<StarPredictor> table_star_predictors();
/// The alpha of smallest squared error for each valence of this mesh.
StarPredictor fitted_star_predictor(const std::vector<StarSample>& samples);

/// Second derivatives as rings of six show them, all three coordinates together (the thesis's Table 2.4).
struct SecondDerivatives {
  size_t stars = 0;
  double laplacian = 0;  ///< variance of f_uu + f_vv
  double saddle = 0;     ///< variance of f_uv, and of (f_uu - f_vv) / 2, their mean
};
SecondDerivatives second_derivatives(const std::vector<Star>& stars,
                                     const std::vector<std::array<double, 3>>& positions);

std::vector<Point> residuals(const std::vector<StarSample>& samples, const StarPredictor& predictor);

}  // namespace maille::bench
