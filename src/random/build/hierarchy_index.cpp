#include "random/build/hierarchy_index.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maille {
namespace {

/// Numbers groups and charts as the file has them. A group comes behind the one whose charts it refines, so
/// that readers find no loops; neighbours in space come from neighbours in the group before, so they lie near
/// each other in the file.
class Indexer {
 public:
  Indexer(const Hierarchy& hierarchy, std::span<const ChartExtent> extents, const Vector3& origin,
          double rounding)
      : hierarchy_(hierarchy),
        extents_(extents),
        origin_(origin),
        rounding_(rounding),
        number_(hierarchy.groups.size(), no_group) {}

  IndexedHierarchy run() {
    add_root();
    // Coarse levels first; within a level, groups in the order in which the charts that they replace come.
    for (uint32_t level = hierarchy_.levels(); level-- > 0;) add_groups_of(level);
    for (size_t g = 0; g < result_.groups.size(); ++g) {
      for (const uint32_t chart : result_.charts[g]) result_.groups[g].charts.push_back(indexed(chart));
    }
    find_frame();
    return std::move(result_);
  }

 private:
  /// The root has all charts that no group was made from: the coarsest ones, and those that could not be
  /// simplified.
  void add_root() {
    IndexedGroup& root = result_.groups.emplace_back();
    root.level = std::max(hierarchy_.levels(), 1u) - 1;
    root.view_error = root.bound = std::numeric_limits<double>::infinity();
    std::vector<uint32_t>& charts = result_.charts.emplace_back();
    for (uint32_t i = 0; i < hierarchy_.charts.size(); ++i) {
      if (hierarchy_.charts[i].consumer == no_group) charts.push_back(i);
    }
    for (const uint32_t chart : charts) {
      const Sphere sphere = in_space(hierarchy_.charts[chart].sphere);
      root.sphere = chart == charts.front() ? sphere : enclosing(root.sphere, sphere);
    }
  }
  /// `before` is read once: groups that are added here have charts of a finer level, which later calls look
  /// at.
  void add_groups_of(uint32_t level) {
    const size_t before = result_.charts.size();
    for (size_t g = 0; g < before; ++g) {
      for (size_t i = 0; i < result_.charts[g].size(); ++i) {
        const uint32_t producer = hierarchy_.charts[result_.charts[g][i]].producer;
        if (producer == no_group || number_[producer] != no_group) continue;
        if (hierarchy_.groups[producer].level == level) add_group(producer);
      }
    }
  }
  void add_group(uint32_t number) {
    const ChartGroup& group = hierarchy_.groups[number];
    number_[number] = static_cast<uint32_t>(result_.groups.size());
    IndexedGroup& added = result_.groups.emplace_back();
    added.level = group.level;
    added.view_error = group.view_error;
    added.bound = group.bound;
    added.sphere = in_space(group.sphere);
    added.replaces = static_cast<uint32_t>(group.outputs.size());
    result_.charts.push_back(group.inputs);
  }

  /// Around the positions themselves.
  Sphere in_space(const Sphere& local) const {
    return {local.centre + origin_, local.radius + 2 * rounding_};
  }
  IndexedChart indexed(uint32_t number) const {
    const Chart& chart = hierarchy_.charts[number];
    IndexedChart indexed;
    indexed.sphere = in_space(chart.sphere);
    indexed.producer = chart.producer == no_group ? no_group : number_[chart.producer];
    indexed.faces = extents_[number].faces;
    indexed.box = extents_[number].box;
    return indexed;
  }

  /// The least cube with sides along the axes around all spheres, so that what is packed relative to it fits.
  void find_frame() {
    Vector3 low, high;
    bool first = true;
    const auto add = [&](const Sphere& sphere) {
      for (unsigned k = 0; k < 3; ++k) {
        low[k] =
            first ? sphere.centre[k] - sphere.radius : std::min(low[k], sphere.centre[k] - sphere.radius);
        high[k] =
            first ? sphere.centre[k] + sphere.radius : std::max(high[k], sphere.centre[k] + sphere.radius);
      }
      first = false;
    };
    for (const IndexedGroup& group : result_.groups) {
      add(group.sphere);
      for (const IndexedChart& chart : group.charts) add(chart.sphere);
    }
    const Vector3 size = high - low;
    result_.frame.low = low;
    // Radii of a whole frame fit, with room for their rounding.
    result_.frame.size = std::max({size[0], size[1], size[2]}) * 1.01;
    // A mesh of one place, or none, has no size; any step does then, but for 0, by which packing would
    // divide.
    if (!(result_.frame.size > 0)) result_.frame.size = 1;
  }

  const Hierarchy& hierarchy_;
  std::span<const ChartExtent> extents_;
  const Vector3& origin_;
  double rounding_;
  IndexedHierarchy result_;
  std::vector<uint32_t> number_;
};

}  // namespace

Box box_in_space(std::span<const uint32_t> vertices, const LocalPositions& positions,
                 const Vector3& if_none) {
  Box box{if_none, if_none};
  for (size_t i = 0; i < vertices.size(); ++i) {
    for (unsigned k = 0; k < 3; ++k) {
      const double x =
          positions.origin[k] + static_cast<double>(positions.numbers[size_t{3} * vertices[i] + k]);
      const double low = x - positions.rounding, high = x + positions.rounding;
      box.low[k] = i == 0 ? low : std::min(box.low[k], low);
      box.high[k] = i == 0 ? high : std::max(box.high[k], high);
    }
  }
  return box;
}

IndexedHierarchy index_hierarchy(const Hierarchy& hierarchy, std::span<const ChartExtent> extents,
                                 const Vector3& origin, double rounding) {
  return Indexer(hierarchy, extents, origin, rounding).run();
}

IndexedHierarchy index_hierarchy(const Hierarchy& hierarchy, const FaceLists& faces,
                                 const LocalPositions& positions) {
  std::vector<ChartExtent> extents;
  std::vector<uint32_t> used;
  for (const Chart& chart : hierarchy.charts) {
    used = chart.triangles;
    for (const uint32_t face : chart.faces)
      used.insert(used.end(), faces.face(face).begin(), faces.face(face).end());
    const Vector3 centre = chart.sphere.centre + positions.origin;
    extents.push_back({box_in_space(used, positions, centre), static_cast<uint32_t>(chart.face_count())});
  }
  return index_hierarchy(hierarchy, extents, positions.origin, positions.rounding);
}

}  // namespace maille
