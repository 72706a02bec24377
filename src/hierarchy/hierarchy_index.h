#pragma once

#include <span>
#include <vector>

#include "hierarchy/chart_index.h"
#include "hierarchy/local_positions.h"
#include "hierarchy/spatial_graph.h"

namespace maille {

/// A hierarchy as groups that refine charts, in the order in which a file has them: coarse to fine.
struct IndexedHierarchy {
  IndexFrame frame;
  std::vector<IndexedGroup> groups;           ///< without places, sizes and checks, which its writer fills in
  std::vector<std::vector<uint32_t>> charts;  ///< by group and place: the number in the hierarchy
};

IndexedHierarchy index_hierarchy(const Hierarchy& hierarchy, const FaceLists& faces,
                                 const LocalPositions& positions);

}  // namespace maille
