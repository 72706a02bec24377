#include "polygons.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <tuple>

#include "stencil_tables.h"
#include "theory/matrix.h"

namespace maille::bench {

namespace {

constexpr size_t most_corners = tables::most_degree_beside;

using Weights = std::vector<double>;
using Key = std::tuple<unsigned, unsigned, unsigned>;  // degrees and known corners

Key key_of(const CornerSample& sample) {
  return {sample.known_degree, sample.degree, sample.known};
}

/// Faces on both sides of each directed edge; edges of more than one face in a direction are left out.
std::map<std::pair<uint32_t, uint32_t>, std::pair<uint32_t, uint32_t>> faces_by_edge(
    const std::vector<Face>& faces) {
  std::map<std::pair<uint32_t, uint32_t>, std::pair<uint32_t, uint32_t>> found;
  for (uint32_t f = 0; f < faces.size(); ++f) {
    for (uint32_t k = 0; k < faces[f].size(); ++k) {
      found.emplace(std::pair(faces[f][k], faces[f][(k + 1) % faces[f].size()]), std::pair(f, k));
    }
  }
  return found;
}

/// The corners of a face, from corner k on.
std::vector<Point> turned(const Face& face, uint32_t k, const std::vector<Point>& points) {
  std::vector<Point> result;
  for (size_t i = 0; i < face.size(); ++i) result.push_back(points[face[(k + i) % face.size()]]);
  return result;
}

/// `old` begins with the common edge a0 a1; `fresh` with a1 a0, its new corners follow.
void add_samples(const std::vector<Point>& old, const std::vector<Point>& fresh,
                 std::vector<CornerSample>& samples) {
  if (std::max(old.size(), fresh.size()) > most_corners) return;
  std::vector<Point> known = old;
  for (unsigned i = 2; i < fresh.size(); ++i) {
    samples.push_back(
        {static_cast<unsigned>(old.size()), static_cast<unsigned>(fresh.size()), i - 2, fresh[i], known});
    known.push_back(fresh[i]);
  }
}

Weights from_table(const int32_t* row, size_t count) {
  Weights weights;
  for (size_t i = 0; i < count; ++i) weights.push_back(row[i] / double(1 << tables::table_bits));
  return weights;
}

Weights weights_of(const CornerSample& sample, CornerRule rule, unsigned level) {
  Weights weights(sample.points.size());
  if (rule == CornerRule::parallelogram) {
    // The three corners before in the face, which begins with a1 a0; across for the first.
    const auto own = [&](unsigned i) -> double& {
      return weights[i == 0 ? 1 : i == 1 ? 0 : sample.known_degree + i - 2];
    };
    if (sample.known == 0) {
      weights[0] = weights[1] = 1;
      weights[2] = -1;
    } else {
      own(sample.known + 1) += 1;
      own(sample.known) -= 1;
      own(sample.known - 1) += 1;
    }
  } else if (rule == CornerRule::alone) {
    // In the order of the face: a1, a0, then the new corners.
    const Weights own =
        from_table(tables::polygon_weights(0, sample.degree, sample.known + 2), sample.known + 2);
    weights[1] = own[0];
    weights[0] = own[1];
    std::copy(own.begin() + 2, own.end(), weights.begin() + sample.known_degree);
  } else {
    weights =
        from_table(tables::polygon_beside_weights(level, sample.known_degree, sample.degree, sample.known),
                   weights.size());
  }
  return weights;
}

Point residual(const CornerSample& sample, const Weights& weights) {
  Point result;
  for (size_t k = 0; k < 3; ++k) {
    double prediction = 0;
    for (size_t i = 0; i < weights.size(); ++i) prediction += weights[i] * sample.points[i][k];
    result[k] = sample.target[k] - static_cast<int32_t>(std::floor(prediction + 0.5));
  }
  return result;
}

/// Normal equations about the first point, so that the weights sum to 1.
struct Fit {
  Matrix squares, products;
  void add(const CornerSample& sample) {
    const size_t count = sample.points.size() - 1;
    if (squares.rows() == 0) squares = Matrix(count, count), products = Matrix(count, 1);
    for (size_t k = 0; k < 3; ++k) {
      const auto at = [&](size_t i) { return double(sample.points[i + 1][k]) - sample.points[0][k]; };
      for (size_t i = 0; i < count; ++i) {
        for (size_t j = 0; j < count; ++j) squares(i, j) += at(i) * at(j);
        products(i, 0) += at(i) * (double(sample.target[k]) - sample.points[0][k]);
      }
    }
  }
  Weights solve() const {
    const Matrix solved = least_squares(squares, products, 1e-9 * norm(squares)).shortest;
    Weights weights = {1};
    for (size_t i = 0; i < solved.rows(); ++i) {
      weights.push_back(solved(i, 0));
      weights[0] -= solved(i, 0);
    }
    return weights;
  }
};

}  // namespace

std::vector<CornerSample> find_corners(const std::vector<Face>& faces, const std::vector<Point>& points) {
  const auto by_edge = faces_by_edge(faces);
  std::vector<bool> seen(faces.size());
  std::vector<CornerSample> samples;
  for (uint32_t first = 0; first < faces.size(); ++first) {
    if (seen[first]) continue;
    seen[first] = true;
    for (std::deque<uint32_t> queue{first}; !queue.empty(); queue.pop_front()) {
      const Face& face = faces[queue.front()];
      for (uint32_t k = 0; k < face.size(); ++k) {
        const auto found = by_edge.find({face[(k + 1) % face.size()], face[k]});
        if (found == by_edge.end() || seen[found->second.first]) continue;
        const auto [other, corner] = found->second;
        seen[other] = true;
        queue.push_back(other);
        add_samples(turned(face, k, points), turned(faces[other], corner, points), samples);
      }
    }
  }
  return samples;
}

std::vector<Point> residuals(const std::vector<CornerSample>& samples, CornerRule rule, unsigned level) {
  std::map<Key, Weights> weights;
  std::vector<Point> result;
  for (const CornerSample& sample : samples) {
    Weights& found = weights[key_of(sample)];
    if (found.empty()) found = weights_of(sample, rule, level);
    result.push_back(residual(sample, found));
  }
  return result;
}

std::vector<Point> fitted_residuals(const std::vector<CornerSample>& samples) {
  std::map<Key, Fit> fits;
  for (const CornerSample& sample : samples) fits[key_of(sample)].add(sample);
  std::map<Key, Weights> weights;
  for (const auto& [key, fit] : fits) weights[key] = fit.solve();
  std::vector<Point> result;
  for (const CornerSample& sample : samples) result.push_back(residual(sample, weights[key_of(sample)]));
  return result;
}

}  // namespace maille::bench
