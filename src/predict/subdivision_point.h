#pragma once

#include <vector>

#include "predict/triangle_surface.h"

// Points that subdivision adds, each predicted from the points around it.
namespace maille {

/// Weights of a vertex of valence K and its ring, for the middle of the edge to ring vertex 0 (modified
/// butterfly) or of the triangle between ring vertices 0 and 1 (sqrt3): Taylor predictions of order 2 in
/// closed form, for any K from 3 on; the centre first.
std::vector<double> butterfly_ring_weights(unsigned valence);
std::vector<double> sqrt3_ring_weights(unsigned valence);

/// Predicts new points of one surface. What a stencil misses beyond a border is reflected from this side of
/// it.
class PointPredictor {
 public:
  explicit PointPredictor(const TriangleSurface& surface);

  /// The middle of the edge of h.
  Position edge_middle(uint32_t h);
  /// The middle of a triangle.
  Position triangle_middle(uint32_t triangle);
  /// A third of the way along a border half-edge.
  Position border_third(uint32_t h) const;
  /// The same from its other end.
  Position border_two_thirds(uint32_t h) const;

 private:
  using Weights = std::vector<double>;

  const Position& at(uint32_t point) const { return surface_.points[point]; }
  bool find_ring(uint32_t h);
  Position from_ring(uint32_t h, std::vector<Weights>& cache, Weights (*make)(unsigned));
  Position across(uint32_t h) const;
  Position butterfly(uint32_t h) const;
  Position twelve_points(uint32_t h) const;
  void add_beyond(uint32_t h, Position& sum) const;
  Position along_border(uint32_t h, const std::array<double, 4>& weights) const;

  const TriangleSurface& surface_;
  std::vector<uint32_t> ring_;
  std::vector<uint32_t> border_before_;  // by point: where the border comes from; empty without a border
  std::vector<uint32_t> border_after_;
  std::vector<Weights> butterfly_weights_;  // by valence
  std::vector<Weights> sqrt3_weights_;
};

}  // namespace maille
