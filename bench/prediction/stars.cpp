#include "stars.h"

#include <maille/predict.h>

#include <algorithm>
#include <cmath>

#include "rings.h"
#include "stencil_tables.h"

namespace maille::bench {

namespace {

bool find_tips(const EdgeFinder& edges, Star& star) {
  for (size_t i = 0; i < star.ring.size(); ++i) {
    star.tips.push_back(edges.tip(star.ring[(i + 1) % star.ring.size()], star.ring[i]));
    if (star.tips.back() == EdgeFinder::none) return false;
  }
  return true;
}

/// Marks a star's vertices as needed, unless one of them, or its centre, is taken already.
class Separator {
 public:
  explicit Separator(size_t points) : needed_(points), centre_(points) {}
  bool takes(const Star& star) {
    const auto is_centre = [&](uint32_t v) { return centre_[v]; };
    if (needed_[star.centre] || std::any_of(star.ring.begin(), star.ring.end(), is_centre) ||
        std::any_of(star.tips.begin(), star.tips.end(), is_centre)) {
      return false;
    }
    for (const uint32_t v : star.ring) needed_[v] = true;
    for (const uint32_t v : star.tips) needed_[v] = true;
    centre_[star.centre] = true;
    return true;
  }

 private:
  std::vector<bool> needed_;
  std::vector<bool> centre_;
};

std::array<double, 3> mean(const std::vector<uint32_t>& vertices, const std::vector<Point>& points) {
  std::array<double, 3> sum = {};
  for (const uint32_t v : vertices) {
    for (size_t k = 0; k < 3; ++k) sum[k] += points[v][k];
  }
  for (double& x : sum) x /= static_cast<double>(vertices.size());
  return sum;
}

StarPredictor constant(std::string name, double alpha) {
  StarPredictor predictor{std::move(name), {}};
  predictor.alpha.fill(alpha);
  return predictor;
}

/// The share of the ring in the weights of the solver.
StarPredictor derived(std::string name, const std::string& tips, PredictionRule::Kind kind) {
  StarPredictor predictor{std::move(name), {}};
  for (unsigned k = 3; k <= largest_valence; ++k) {
    NamedStencil star = *named_stencil("k-star:" + std::to_string(k) + ":" + tips);
    star.rule.kind = kind;
    predictor.alpha[k] = k * predict(star.stencil, star.rule)->weights[0];
  }
  return predictor;
}

}  // namespace

std::vector<Star> find_stars(const Triangles& mesh, bool apart) {
  const EdgeFinder edges(mesh);
  Separator separator(mesh.positions.size());
  std::vector<Star> stars;
  for (uint32_t v = 0; v < mesh.positions.size(); ++v) {
    Star star{v, closed_ring(edges, v, largest_valence), {}};
    if (star.ring.empty() || !find_tips(edges, star)) continue;
    if (apart && !separator.takes(star)) continue;
    stars.push_back(std::move(star));
  }
  return stars;
}

std::vector<StarSample> sample(const std::vector<Star>& stars, const std::vector<Point>& points) {
  std::vector<StarSample> samples;
  for (const Star& star : stars) {
    samples.push_back({static_cast<unsigned>(star.ring.size()), points[star.centre], mean(star.ring, points),
                       mean(star.tips, points)});
  }
  return samples;
}

std::vector<StarPredictor> fixed_star_predictors() {
  using Kind = PredictionRule::Kind;
  return {constant("APP", 2), constant("CPM", 1.15), derived("spectral", "reflected", Kind::spectral),
          derived("Taylor", "reflected", Kind::taylor),
          derived("Taylor, equilateral", "equilateral", Kind::taylor)};
}

std::vector<StarPredictor> table_star_predictors() {
  std::vector<StarPredictor> all;
  for (unsigned level = 0; level < tables::noise_levels; ++level) {
    for (const unsigned tips : {0u, 1u}) {
      StarPredictor predictor{"Taylor, noise", {}};
      for (unsigned k = 3; k <= largest_valence; ++k) {
        predictor.alpha[k] = double(tables::k_star[level][k - 3][tips]) / (1 << tables::table_bits);
      }
      all.push_back(predictor);
    }
  }
  return all;
}

StarPredictor fitted_star_predictor(const std::vector<StarSample>& samples) {
  std::array<double, largest_valence + 1> products = {}, squares = {};
  for (const StarSample& s : samples) {
    for (size_t k = 0; k < 3; ++k) {
      const double slope = s.ring[k] - s.tips[k];
      products[s.valence] += (s.centre[k] - s.tips[k]) * slope;
      squares[s.valence] += slope * slope;
    }
  }
  StarPredictor predictor = constant("least squares", 1);
  for (unsigned k = 3; k <= largest_valence; ++k) {
    if (squares[k] > 0) predictor.alpha[k] = products[k] / squares[k];
  }
  return predictor;
}

SecondDerivatives second_derivatives(const std::vector<Star>& stars,
                                     const std::vector<std::array<double, 3>>& positions) {
  SecondDerivatives result;
  for (const Star& star : stars) {
    if (star.ring.size() != 6) continue;
    ++result.stars;
    for (size_t k = 0; k < 3; ++k) {
      double sum = 0, cosine = 0, sine = 0;
      for (size_t i = 0; i < 6; ++i) {
        const double difference = positions[star.ring[i]][k] - positions[star.centre][k];
        const double angle = 2 * std::acos(-1.0) * static_cast<double>(i) / 3;  // twice that of the vertex
        sum += difference;
        cosine += difference * std::cos(angle);
        sine += difference * std::sin(angle);
      }
      result.laplacian += 4.0 / 9 * sum * sum;
      result.saddle += 2.0 / 9 * (cosine * cosine + sine * sine);
    }
  }
  return result;
}

std::vector<Point> residuals(const std::vector<StarSample>& samples, const StarPredictor& predictor) {
  std::vector<Point> result;
  for (const StarSample& s : samples) {
    const double alpha = predictor.alpha[s.valence];
    Point residual;
    for (size_t k = 0; k < 3; ++k) {
      const double prediction = alpha * s.ring[k] + (1 - alpha) * s.tips[k];
      residual[k] = s.centre[k] - static_cast<int32_t>(std::floor(prediction + 0.5));
    }
    result.push_back(residual);
  }
  return result;
}

}  // namespace maille::bench
