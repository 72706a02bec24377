#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

// Meshes as the benchmark of predictors sees them.
namespace maille::bench {

using Point = std::array<int32_t, 3>;  ///< on a lattice
using Triangle = std::array<uint32_t, 3>;

struct Triangles {
  std::string name;
  std::vector<std::array<double, 3>> positions;
  std::vector<Triangle> faces;                  ///< polygons cut into fans
  std::vector<std::vector<uint32_t>> polygons;  ///< the same as they were

  /// Positions on a lattice of 2^bits values along the longest side of the bounding box.
  std::vector<Point> on_lattice(unsigned bits) const;
};

Result<Triangles> load_triangles(const std::string& path);

/// Finds the triangle on the left of a directed edge; in surfaces there is one at most.
class EdgeFinder {
 public:
  explicit EdgeFinder(const Triangles& mesh);
  /// The third vertex of that triangle; none, if there is not exactly one.
  uint32_t tip(uint32_t from, uint32_t to) const;
  /// Triangles of a vertex.
  std::vector<Triangle> around(uint32_t vertex) const;

  static constexpr uint32_t none = 0xffffffff;

 private:
  const Triangles& mesh_;
  std::vector<uint32_t> first_;  // by vertex, into faces_
  std::vector<uint32_t> faces_;
};

}  // namespace maille::bench
