#pragma once

#include <maille/error.h>
#include <maille/mesh.h>
#include <cstdint>
#include <span>

namespace maille {

/// Schemes that keep the points they are given. Both are Taylor predictions of order 2 or 3:
/// docs/prediction.md.
enum class SubdivisionScheme : uint8_t {
  butterfly,  ///< each triangle becomes 4: modified butterfly (Dyn et al. 1990, Zorin et al. 1996)
  sqrt3,      ///< each triangle becomes 3 (after Labsik and Greiner 2000); two levels cut each edge in three
};

struct SubdivisionOptions {
  SubdivisionScheme scheme = SubdivisionScheme::butterfly;
  unsigned levels = 1;
};

/// Takes a subdivided surface as it is made: begin(), all points in order, all triangles in order.
class SubdivisionOutput {
 public:
  virtual ~SubdivisionOutput() = default;
  [[nodiscard]] virtual Result<> begin(uint64_t points, uint64_t triangles) = 0;
  /// Three coordinates for each point.
  [[nodiscard]] virtual Result<> points(std::span<const double> coordinates) = 0;
  /// Three numbers of points for each triangle.
  [[nodiscard]] virtual Result<> triangles(std::span<const uint32_t> corners) = 0;
};

/// Subdivides the triangles of a mesh; borders stay borders and depend on themselves only. The points of the
/// mesh come first, in their order. Memory: that of the mesh and about a million triangles of the result,
/// whatever its size; with sqrt3 and an odd number of levels, three times that of the mesh. Errors:
/// malformed_input, naming what is no triangle or which edge has more than two, or two that disagree on which
/// side is up; usage, when the result would have more than max_points points; and those of `output`.
[[nodiscard]] Result<> subdivide(const Mesh& mesh, const SubdivisionOptions& options,
                                 SubdivisionOutput& output);

}  // namespace maille
