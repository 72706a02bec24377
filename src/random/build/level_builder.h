#pragma once

#include <maille/executor.h>

#include <optional>
#include <span>
#include <vector>

#include "random/build/spatial_graph.h"
#include "random/hierarchy.h"

namespace maille {

/// How charts and groups are cut, in triangles; a polygon counts as the triangles it can be cut into.
struct ChartSizes {
  /// Wished for in a chart of level 0. With fewer than in other charts, a group has more of them, so that the
  /// coarser levels stay what they are.
  uint32_t finest_faces = 4096;
  uint32_t chart_faces = 4096;  ///< of all other levels
  uint32_t group_charts = 8;    ///< a group has so many times chart_faces

  /// The sizes that `most_cells_per_part` asks for. Coarser charts are never smaller than usual, but as large
  /// as the finest.
  static ChartSizes of(const std::optional<uint64_t>& cells);
};

/// The vertices of a mesh, or of a piece of one whose border to other pieces stays as it is.
struct LevelVertices {
  std::span<const float> positions;    ///< three numbers a vertex
  std::span<const uint32_t> class_of;  ///< by vertex: one at the same place, which stands for it in triangles
  std::span<const uint8_t> held;       ///< by vertex: another piece has it, it stays; empty: none
  /// By corner of the faces: at one vertex equal numbers, equal values; see seams.h. Empty: they do not
  /// differ.
  std::span<const uint32_t> corner_values = {};

  uint32_t size() const { return static_cast<uint32_t>(positions.size() / 3); }
};

/// For each vertex the lowest one at the same place, bit for bit but for the sign of zero.
std::vector<uint32_t> lowest_at_place(std::span<const float> positions);

/// Charts of level 0, with their faces and spheres.
std::vector<Chart> cut_into_charts(const FaceLists& faces, const LevelVertices& vertices,
                                   const ChartSizes& sizes, Executor& executor = serial_executor());

/// A group without what it inherits from finer ones.
struct SimplifiedGroup {
  std::vector<uint32_t> inputs;  ///< places in the charts given
  std::vector<Chart> outputs;    ///< triangles and spheres
  double view_error = 0, bound = 0;
};
/// Whether a level of `after` triangles stays above one of `before`. Levels aim at a fourth, and what cannot
/// be simplified, such as triangles between points anywhere, would have dozens of levels, each about as large
/// as the mesh. Since each that stays has at most three fourths of the one before, all of them together have
/// less than three times the triangles of the mesh, in the file and in time. This also ends the loop of
/// levels. Chosen, not swept: levels of scans have 0.25 to 0.3.
inline bool is_worth_a_level(uint64_t before, uint64_t after) {
  return after < before - before / 4;
}

/// Groups charts of one level and simplifies each group. `alone`: there are no other charts of this level.
std::vector<SimplifiedGroup> simplify_charts(const FaceLists& faces, const LevelVertices& vertices,
                                             std::span<const Chart> charts, bool alone,
                                             const ChartSizes& sizes, Executor& executor);

/// Adds a group with numbers of charts as inputs: its sphere and errors follow from theirs. Returns its
/// number; outputs must be added by the caller.
uint32_t add_group(Hierarchy& hierarchy, uint32_t level, std::vector<uint32_t> inputs, double view_error,
                   double bound);

/// Calls f(a, b, c) for the triangles of a chart, polygons as fans, over what stands for its vertices.
template <class F>
void for_each_triangle(const FaceLists& faces, std::span<const uint32_t> class_of, const Chart& chart, F f) {
  for (size_t t = 0; t < chart.triangles.size(); t += 3) {
    f(chart.triangles[t], chart.triangles[t + 1], chart.triangles[t + 2]);
  }
  for (const uint32_t face : chart.faces) {
    const auto c = faces.face(face);
    for (size_t k = 2; k < c.size(); ++k) f(class_of[c[0]], class_of[c[k - 1]], class_of[c[k]]);
  }
}
uint64_t count_triangles(const FaceLists& faces, const Chart& chart);

}  // namespace maille
