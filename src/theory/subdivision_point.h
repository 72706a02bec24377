#pragma once

#include <vector>

#include "theory/triangle_surface.h"

// Points that subdivision adds, each predicted from the points around it.
namespace maille {

/// Weights of a vertex of valence K and its ring, for the middle of the edge to ring vertex 0 (modified
/// butterfly) or of the triangle between ring vertices 0 and 1 (sqrt3): Taylor predictions of order 2 in
/// closed form, for any K; the centre first, then the ring. They sum up to 1.
std::vector<double> butterfly_ring_weights(unsigned valence);
std::vector<double> sqrt3_ring_weights(unsigned valence);

/// Weights of rings by valence, made when first asked for; memory is that of the largest valence that was
/// met. Not for several threads.
class RingWeights {
 public:
  explicit RingWeights(std::vector<double> (*make)(unsigned)) : make_(make) {}
  const std::vector<double>& of(size_t valence) {
    if (weights_.size() <= valence) weights_.resize(valence + 1);
    if (weights_[valence].empty()) weights_[valence] = make_(static_cast<unsigned>(valence));
    return weights_[valence];
  }

 private:
  std::vector<double> (*make_)(unsigned);
  std::vector<std::vector<double>> weights_;
};

/// Predicts new points of one surface. What a stencil misses beyond a border is reflected from this side of
/// it.
class PointPredictor {
 public:
  /// `weights`: those of the scheme that is asked for, butterfly or sqrt3.
  PointPredictor(const TriangleSurface& surface, RingWeights& weights);

  /// The middle of the edge of h.
  Position edge_middle(uint32_t h);
  /// The middle of a triangle.
  Position triangle_middle(uint32_t triangle);
  /// A third of the way along a border half-edge.
  Position border_third(uint32_t h) const;
  /// The same from its other end.
  Position border_two_thirds(uint32_t h) const;

 private:
  const Position& at(uint32_t point) const { return surface_.points[point]; }
  bool find_ring(uint32_t h);
  Position from_ring(uint32_t h);
  Position across(uint32_t h) const;
  Position butterfly(uint32_t h) const;
  Position twelve_points(uint32_t h) const;
  void add_beyond(uint32_t h, Position& sum) const;
  Position along_border(uint32_t h, const std::array<double, 4>& weights) const;

  const TriangleSurface& surface_;
  RingWeights& weights_;
  std::vector<uint32_t> ring_;
  std::vector<uint32_t> border_before_;  // by point: where the border comes from; empty without a border
  std::vector<uint32_t> border_after_;
};

}  // namespace maille
