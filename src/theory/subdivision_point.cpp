#include "theory/subdivision_point.h"

#include <cmath>

namespace maille {

namespace {

const double pi = std::acos(-1.0);

void add(Position& sum, double weight, const Position& point) {
  for (size_t k = 0; k < 3; ++k) sum[k] += weight * point[k];
}

Position reflected(const Position& point, const Position& a, const Position& b) {
  return {a[0] + b[0] - point[0], a[1] + b[1] - point[1], a[2] + b[2] - point[2]};
}

Position mean(const Position& a, const Position& b) {
  return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

/// Taylor prediction of order 2 at a distance from the middle of a ring of radius 1, in closed form:
/// functions of degree 0 and 2, 1 and 2 are the ring's waves of frequency 0, 1 and 2. Of the highest
/// frequency of an even ring there is one wave instead of two. docs/prediction.md, "What comes out".
std::vector<double> ring_weights(unsigned valence, double radius, double angle) {
  const double square = radius * radius;
  const double first = valence == 2 ? 1 : 2;
  const double second = valence < 4 ? 0 : valence == 4 ? 1 : 2;
  std::vector<double> weights = {1 - square};
  for (unsigned j = 0; j < valence; ++j) {
    const double turn = 2 * pi * j / valence - angle;
    weights.push_back((square + first * radius * std::cos(turn) + second * square * std::cos(2 * turn)) /
                      valence);
  }
  return weights;
}

}  // namespace

std::vector<double> butterfly_ring_weights(unsigned valence) {
  return ring_weights(valence, 0.5, 0);
}

std::vector<double> sqrt3_ring_weights(unsigned valence) {
  return ring_weights(valence, std::sqrt(1.0 / 3), pi / valence);
}

PointPredictor::PointPredictor(const TriangleSurface& surface, RingWeights& weights)
    : surface_(surface), weights_(weights) {
  for (uint32_t h = 0; h < surface.half_edges(); ++h) {
    if (surface.opposite[h] != TriangleSurface::border) continue;
    if (border_after_.empty()) {
      border_before_.resize(surface.points.size(), TriangleSurface::border);
      border_after_.resize(surface.points.size(), TriangleSurface::border);
    }
    border_after_[surface.origin(h)] = surface.target(h);
    border_before_[surface.target(h)] = surface.origin(h);
  }
}

/// The neighbours of h's origin, counter-clockwise from h's target; false when there is a border among them.
bool PointPredictor::find_ring(uint32_t h) {
  ring_.clear();
  uint32_t turned = h;
  do {
    ring_.push_back(surface_.target(turned));
    turned = surface_.turn(turned);
    if (turned == TriangleSurface::border) return false;
  } while (turned != h);
  return true;
}

Position PointPredictor::from_ring(uint32_t h) {
  const size_t valence = ring_.size();
  const std::vector<double>& weights = weights_.of(valence);
  Position sum{};
  add(sum, weights[0], at(surface_.origin(h)));
  for (size_t j = 0; j < valence; ++j) add(sum, weights[1 + j], at(ring_[j]));
  return sum;
}

/// The vertex across the edge of h, or its reflection.
Position PointPredictor::across(uint32_t h) const {
  const uint32_t other = surface_.opposite[h];
  if (other != TriangleSurface::border) return at(surface_.tip(other));
  return reflected(at(surface_.tip(h)), at(surface_.origin(h)), at(surface_.target(h)));
}

/// 1/2, 1/8, -1/16: Dyn, Levin and Gregory 1990.
Position PointPredictor::butterfly(uint32_t h) const {
  Position sum{};
  for (const uint32_t side : {h, surface_.opposite[h]}) {
    add(sum, 1.0 / 2, at(surface_.origin(side)));
    add(sum, 1.0 / 8, at(surface_.tip(side)));
    add(sum, -1.0 / 16, across(TriangleSurface::next(side)));
    add(sum, -1.0 / 16, across(TriangleSurface::previous(side)));
  }
  return sum;
}

Position PointPredictor::along_border(uint32_t h, const std::array<double, 4>& weights) const {
  const uint32_t a = surface_.origin(h);
  const uint32_t b = surface_.target(h);
  Position sum{};
  add(sum, weights[0], at(border_before_[a]));
  add(sum, weights[1], at(a));
  add(sum, weights[2], at(b));
  add(sum, weights[3], at(border_after_[b]));
  return sum;
}

Position PointPredictor::edge_middle(uint32_t h) {
  const uint32_t other = surface_.opposite[h];
  // Four points of a line (Dyn, Gregory and Levin 1987): Taylor in one dimension.
  if (other == TriangleSurface::border) return along_border(h, {-1.0 / 16, 9.0 / 16, 9.0 / 16, -1.0 / 16});
  // From the ring of an end that is not regular; of two such ends the mean (Zorin, Schroeder and Sweldens
  // 1996). ring_ holds one at a time, so the first prediction is made before the second ring is looked for.
  const bool first = find_ring(h) && ring_.size() != 6;
  const Position from_first = first ? from_ring(h) : Position{};
  const bool second = find_ring(other) && ring_.size() != 6;
  if (!first && !second) return butterfly(h);
  if (!second) return from_first;
  const Position from_second = from_ring(other);
  return first ? mean(from_first, from_second) : from_second;
}

/// Of the triangle across h: its tip, and what lies beyond its two other edges.
void PointPredictor::add_beyond(uint32_t h, Position& sum) const {
  const Position& a = at(surface_.origin(h));
  const Position& b = at(surface_.target(h));
  const Position tip = across(h);
  add(sum, -1.0 / 81, tip);
  const uint32_t other = surface_.opposite[h];
  const bool there = other != TriangleSurface::border;
  add(sum, -2.0 / 81, there ? across(TriangleSurface::next(other)) : reflected(b, a, tip));
  add(sum, -2.0 / 81, there ? across(TriangleSurface::previous(other)) : reflected(a, b, tip));
}

/// 32/81, -1/81, -2/81: Labsik and Greiner 2000.
Position PointPredictor::twelve_points(uint32_t h) const {
  Position sum{};
  for (unsigned i = 0; i < 3; ++i) {
    add(sum, 32.0 / 81, at(surface_.origin(h + i)));
    add_beyond(h + i, sum);
  }
  return sum;
}

/// The mean of what irregular corners say by their rings; of regular ones, and at borders, the twelve points.
Position PointPredictor::triangle_middle(uint32_t triangle) {
  Position sum{};
  unsigned count = 0;
  for (uint32_t h = 3 * triangle; h < 3 * triangle + 3; ++h) {
    if (!find_ring(h) || ring_.size() == 6) continue;
    add(sum, 1, from_ring(h));
    ++count;
  }
  if (count == 0) return twelve_points(3 * triangle);
  for (double& x : sum) x /= count;
  return sum;
}

/// Cubic interpolation of four points of a line at a third: Lagrange's weights at 1/3 for places -1, 0, 1, 2.
Position PointPredictor::border_third(uint32_t h) const {
  return along_border(h, {-5.0 / 81, 60.0 / 81, 30.0 / 81, -4.0 / 81});
}

Position PointPredictor::border_two_thirds(uint32_t h) const {
  return along_border(h, {-4.0 / 81, 30.0 / 81, 60.0 / 81, -5.0 / 81});
}

}  // namespace maille
