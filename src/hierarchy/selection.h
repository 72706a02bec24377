#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "hierarchy/chart_index.h"

namespace maille {

/// Charts to be drawn or read: the number of its group and its place in it.
struct ChartPlace {
  uint32_t group = 0;
  uint32_t chart = 0;
  bool operator==(const ChartPlace&) const = default;
};

/// What a selection found in the part of the index that is there. If `missing` names index pages, read these
/// and ask again.
struct Selection {
  std::vector<ChartPlace> charts;  ///< in the order of their places
  std::vector<uint32_t> missing;   ///< pages of the index, rising
  uint64_t faces = 0;              ///< of the charts
};

/// Where charts are wanted; everywhere where nothing is said.
struct Region {
  std::optional<Box> box;
  std::optional<Sphere> sphere;
  /// Half-spaces: n.x + d >= 0 inside. A frustum has six.
  struct Plane {
    Vector3 normal;  ///< of length 1
    double offset = 0;
  };
  std::vector<Plane> planes;

  bool meets(const Sphere& other) const;
  bool meets(const Box& other) const;
};

/// A perspective view. The error of a group is seen from the nearest point of its sphere.
struct View {
  Vector3 eye;
  double pixels_per_radian = 1;  ///< height in pixels / (2 tan(vertical field of view / 2))
  double pixels = 1;             ///< error that may be seen
};

/// How fine: the coarsest charts whose error is within the limit. Limits on errors can not be met where the
/// simplification stopped; level 0 is exact.
struct Detail {
  double bound = std::numeric_limits<double>::infinity();       ///< of the measured distance, world units
  double view_error = std::numeric_limits<double>::infinity();  ///< of the quadric error, world units
  std::optional<View> view;
  uint32_t level = std::numeric_limits<uint32_t>::max();  ///< no charts coarser than this one

  static Detail full() {
    Detail detail;
    detail.level = 0;
    return detail;
  }
  /// Is what replaces the charts of a group, and so their producer, too coarse?
  bool refines(const IndexedGroup& group) const;
};

/// The charts of the cut that `detail` asks for, as far as they meet the region. Visits only groups that meet
/// it.
Selection select(const ChartIndex& index, const Region& region, const Detail& detail);

/// The finest cut of at most so many faces: refines what looks worst first (by `view`, else by error in world
/// units). Faces of charts outside the region do not count and do not come.
Selection select_within(const ChartIndex& index, const Region& region, uint64_t most_faces,
                        const std::optional<View>& view = {});

}  // namespace maille
