#pragma once

#include <maille/error.h>
#include <maille/executor.h>

#include "random/build/level_builder.h"
#include "random/build/spatial_graph.h"
#include "random/hierarchy.h"

namespace maille {

struct HierarchyOptions {
  ChartSizes sizes;
  Executor* executor = nullptr;  ///< nullptr: serial
  Progress progress;
  /// By corner: at one vertex equal numbers, equal values; see seams.h. Empty: they do not differ.
  std::span<const uint32_t> corner_values = {};
};

/// Cuts a mesh into charts and simplifies it level by level until one chart is left, or little more can be
/// removed. `positions`: three numbers a vertex. Vertices of equal position count as one for the coarser
/// levels, so meshes of separate triangles have levels as well. The same for any executor. Error: cancelled.
Result<Hierarchy> build_hierarchy(const FaceLists& faces, std::span<const float> positions, uint32_t vertices,
                                  const HierarchyOptions& options);

}  // namespace maille
