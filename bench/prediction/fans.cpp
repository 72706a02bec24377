#include "fans.h"

#include <maille/predict.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "rings.h"
#include "stencil_tables.h"

namespace maille::bench {

namespace {

constexpr unsigned least_valence = 5;
constexpr unsigned most_valence = 16;

/// Vertices in the order in which they become known.
class Walk {
 public:
  Walk(const Triangles& mesh, const std::vector<Point>& points)
      : points_(points), edges_(mesh), known_(mesh.positions.size()) {}

  void start(const Triangle& face) {
    if (known_[face[0]] || known_[face[1]] || known_[face[2]]) return;
    for (const uint32_t v : face) reach(v);
    while (!foci_.empty()) {
      const uint32_t focus = foci_.front();
      foci_.pop_front();
      complete(focus, closed_ring(edges_, focus, most_valence));
    }
  }
  std::vector<FanSample> samples;
  size_t reached = 0;

 private:
  void reach(uint32_t v) {
    known_[v] = true;
    foci_.push_back(v);
    ++reached;
  }
  void complete(uint32_t focus, const std::vector<uint32_t>& ring) {
    const size_t size = ring.size();
    const auto is_known = [&](uint32_t v) { return known_[v]; };
    const auto first = std::find_if(ring.begin(), ring.end(), is_known);
    if (first == ring.end()) return;
    const auto start = static_cast<size_t>(first - ring.begin());
    for (size_t i = 1; i < size; ++i) {
      const uint32_t v = ring[(start + i) % size];
      if (known_[v]) continue;
      const auto at = [&](size_t step) { return ring[(start + i + step) % size]; };
      if (size >= least_valence && known_[at(1)] && known_[at(2)] && known_[at(size - 2)]) {
        samples.push_back({static_cast<unsigned>(size),
                           points_[v],
                           points_[focus],
                           {points_[at(size - 1)], points_[at(1)]},
                           {points_[at(size - 2)], points_[at(2)]}});
      }
      reach(v);
    }
  }

  const std::vector<Point>& points_;
  EdgeFinder edges_;
  std::vector<bool> known_;
  std::deque<uint32_t> foci_;
};

FanPredictor constant(std::string name, double focus, double near, double far) {
  FanPredictor predictor{std::move(name), false, {}};
  predictor.weights.fill({focus, near, far});
  return predictor;
}

FanPredictor derived(std::string name, const PredictionRule& rule) {
  FanPredictor predictor{std::move(name), false, {}};
  for (unsigned k = least_valence; k <= most_valence; ++k) {
    const auto weights =
        predict(named_stencil("dual-parallelogram:" + std::to_string(k))->stencil, rule)->weights;
    predictor.weights[k] = {weights[0], weights[1], weights[3]};
  }
  return predictor;
}

/// Least squares for one valence: target - focus = near x (sum of the near ones - 2 focus) + far x likewise.
struct Fit {
  double aa = 0, ab = 0, bb = 0, ac = 0, bc = 0;
  void add(double a, double b, double c) { aa += a * a, ab += a * b, bb += b * b, ac += a * c, bc += b * c; }
  FanPredictor::Weights solve() const {
    const double determinant = aa * bb - ab * ab;
    if (!(determinant > 1e-9 * aa * bb)) return {1, 0.5, -0.5};
    const double near = (ac * bb - bc * ab) / determinant;
    const double far = (bc * aa - ac * ab) / determinant;
    return {1 - 2 * near - 2 * far, near, far};
  }
};

}  // namespace

std::vector<FanSample> find_fans(const Triangles& mesh, const std::vector<Point>& points, size_t& reached) {
  Walk walk(mesh, points);
  for (const Triangle& face : mesh.faces) {
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) walk.start(face);
  }
  reached = walk.reached;
  return walk.samples;
}

std::vector<FanPredictor> fixed_fan_predictors() {
  FanPredictor one = constant("parallelogram", 1, 1, -1);
  one.one_side = true;
  PredictionRule gaussian, shortest;
  gaussian.covariance = Covariance::gaussian;
  shortest.order = 1;
  return {one, constant("dual parallelogram", 1, 0.5, -0.5), derived("Taylor, rotation", {}),
          derived("Taylor, gaussian", gaussian), derived("order 1, shortest", shortest)};
}

std::vector<FanPredictor> table_fan_predictors() {
  std::vector<FanPredictor> all;
  for (const auto& level : tables::dual_parallelogram) {
    FanPredictor predictor{"Taylor, noise", false, {}};
    for (unsigned k = least_valence; k <= most_valence; ++k) {
      const int32_t* row = level[k - tables::least_degree];
      const double one = 1 << tables::table_bits;
      predictor.weights[k] = {row[0] / one, row[1] / one, row[2] / one};
    }
    all.push_back(predictor);
  }
  return all;
}

FanPredictor fitted_fan_predictor(const std::vector<FanSample>& samples) {
  std::array<Fit, most_valence + 1> fits;
  for (const FanSample& s : samples) {
    for (size_t k = 0; k < 3; ++k) {
      const double f = s.focus[k];
      fits[s.valence].add(s.near[0][k] + s.near[1][k] - 2 * f, s.far[0][k] + s.far[1][k] - 2 * f,
                          s.target[k] - f);
    }
  }
  FanPredictor predictor{"least squares", false, {}};
  for (unsigned k = least_valence; k <= most_valence; ++k) predictor.weights[k] = fits[k].solve();
  return predictor;
}

std::vector<Point> residuals(const std::vector<FanSample>& samples, const FanPredictor& predictor) {
  std::vector<Point> result;
  for (const FanSample& s : samples) {
    const auto& w = predictor.weights[s.valence];
    Point residual;
    for (size_t k = 0; k < 3; ++k) {
      const double both =
          w.focus * s.focus[k] + w.near * (s.near[0][k] + s.near[1][k]) + w.far * (s.far[0][k] + s.far[1][k]);
      const double prediction = predictor.one_side ? s.focus[k] + s.near[0][k] - s.far[0][k] : both;
      residual[k] = s.target[k] - static_cast<int32_t>(std::floor(prediction + 0.5));
    }
    result.push_back(residual);
  }
  return result;
}

}  // namespace maille::bench
