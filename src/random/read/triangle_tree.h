#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "random/mesh_geometry.h"

namespace maille {

/// Boxes around triangles, for nearest points.
class TriangleTree {
 public:
  /// Both must stay. Positions: three numbers a vertex; those that are no numbers count as 0.
  TriangleTree(std::span<const uint32_t> triangles, std::span<const float> positions);

  /// The squared distance from the nearest triangle, or `bound` if none is nearer; or any distance from a
  /// triangle that is not above `enough`. `most`: how many boxes are opened; where these do not tell, the
  /// least distance so far.
  double squared_distance(const Vector3& from, double bound, double enough = 0, unsigned most = ~0u) const;
  double to_triangle(const Vector3& from, uint32_t triangle) const;
  /// The nearest triangle; there must be one.
  uint32_t nearest(const Vector3& from) const;

 private:
  struct Node {
    Box box;
    uint32_t begin, end;  ///< triangles in order_ (leaf)
    uint32_t right;       ///< the left child follows the node; 0: a leaf
  };
  // Chosen, not swept: smaller leaves mean more boxes, larger ones more triangles to measure.
  static constexpr uint32_t leaf_size = 8;

  Vector3 position(uint32_t vertex) const { return finite_position(positions_, vertex); }
  struct Placed {
    Box box;
    Vector3 corners;  ///< their sum
  };
  /// Calls see(triangle) for those that may be nearer than `bound`, which it may lower.
  template <class See>
  void search(const Vector3& from, const double& bound, double enough, unsigned most, See see) const;
  uint32_t build(const std::vector<Placed>& placed, uint32_t begin, uint32_t end);

  std::span<const uint32_t> triangles_;
  std::span<const float> positions_;
  std::vector<uint32_t> order_;  ///< the triangles, leaf by leaf
  std::vector<Node> nodes_;
};

}  // namespace maille
