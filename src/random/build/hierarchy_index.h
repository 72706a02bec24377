#pragma once

#include <span>
#include <vector>

#include "random/build/local_positions.h"
#include "random/build/spatial_graph.h"
#include "random/chart_index.h"

namespace maille {

/// A hierarchy as groups that refine charts, in the order in which a file has them: coarse to fine.
struct IndexedHierarchy {
  IndexFrame frame;
  std::vector<IndexedGroup> groups;           ///< without places, sizes and checks, which its writer fills in
  std::vector<std::vector<uint32_t>> charts;  ///< by group and place: the number in the hierarchy
};

IndexedHierarchy index_hierarchy(const Hierarchy& hierarchy, const FaceLists& faces,
                                 const LocalPositions& positions);

/// What the index says of a chart, in space, without its sphere.
struct ChartExtent {
  Box box;
  uint32_t faces = 0;
};
/// The same where the charts' faces are not at hand. `origin` and `rounding`: see LocalPositions.
IndexedHierarchy index_hierarchy(const Hierarchy& hierarchy, std::span<const ChartExtent> extents,
                                 const Vector3& origin, double rounding);
/// The box of these vertices, in space.
Box box_in_space(std::span<const uint32_t> vertices, const LocalPositions& positions, const Vector3& if_none);

}  // namespace maille
