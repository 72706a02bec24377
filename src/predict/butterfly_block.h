#pragma once

#include <span>
#include <vector>

#include "predict/subdivision_point.h"
#include "predict/triangle_surface.h"

// Butterfly subdivision of a part of a surface, so that only a part has to be in memory.
namespace maille {

/// Some triangles, and behind them in the list those around: the triangles that share a point with them (the
/// first ring) or with these (the second). Only triangles of the second ring may miss neighbours.
struct ButterflyBlock {
  TriangleSurface surface;
  uint32_t inner = 0;  ///< triangles from here on are those around
};

/// Cuts blocks out of a surface.
class BlockCutter {
 public:
  explicit BlockCutter(const TriangleSurface& surface);

  /// Triangles `first` to `end`, with `rings` rings around.
  ButterflyBlock cut(uint32_t first, uint32_t end, unsigned rings);

 private:
  void choose(uint32_t triangle);
  void choose_ring();
  uint32_t point(uint32_t old, std::vector<Position>& points);
  TriangleSurface chosen_surface();

  const TriangleSurface& surface_;
  std::vector<uint32_t> first_;      // by point, into triangles_
  std::vector<uint32_t> triangles_;  // of each point
  std::vector<uint32_t> chosen_;
  // Names in the block, by name in the surface; for the block at hand only.
  std::vector<uint32_t> triangle_names_;
  std::vector<uint32_t> point_names_;
};

/// The next level: four triangles for each inner one, at its first, second and third corner and in its
/// middle, and `rings` rings of the new size around them, 0 or 2. What a new point depends on are the rings
/// of the ends of its edge; for edges of inner triangles and the first ring these are all here, and two rings
/// of small triangles lie within one of large ones.
ButterflyBlock refined(const ButterflyBlock& block, RingWeights& weights, unsigned rings);

}  // namespace maille
