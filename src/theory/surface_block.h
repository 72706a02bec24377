#pragma once

#include <vector>

#include "theory/triangle_surface.h"

// A part of a surface with what lies around it, so that only a part has to be in memory.
namespace maille {

/// Some triangles, and behind them in the list those around: the triangles that share a point with them (the
/// first ring), with these (the second), and so on. Only triangles of the last ring may miss neighbours.
struct SurfaceBlock {
  TriangleSurface surface;
  uint32_t inner = 0;  ///< triangles from here on are those around
};

/// Which triangles of a block are to be subdivided, numbered.
struct SplitOrder {
  std::vector<uint32_t> numbers;  ///< by triangle; none: is not
  uint32_t count = 0;
};
/// The inner ones, and then those of the first ring if they are wanted.
SplitOrder split_order(const SurfaceBlock& block, bool first_ring);

/// Cuts blocks out of a surface, which must stay. One cutter serves all blocks of a surface, one after the
/// other.
class BlockCutter {
 public:
  explicit BlockCutter(const TriangleSurface& surface);

  /// Triangles `first` to `end`, with `rings` rings around.
  SurfaceBlock cut(uint32_t first, uint32_t end, unsigned rings);

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

}  // namespace maille
