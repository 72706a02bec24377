#include "hierarchy/hierarchy_index.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maille {
namespace {

class Indexer {
 public:
  Indexer(const Hierarchy& hierarchy, const FaceLists& faces, const LocalPositions& positions)
      : hierarchy_(hierarchy),
        faces_(faces),
        positions_(positions),
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
    return {local.centre + positions_.origin, local.radius + 2 * positions_.rounding};
  }
  template <class F>
  void for_each_vertex(const Chart& chart, F f) const {
    for (const uint32_t v : chart.triangles) f(v);
    for (const uint32_t face : chart.faces) {
      for (const uint32_t v : faces_.face(face)) f(v);
    }
  }
  IndexedChart indexed(uint32_t number) const {
    const Chart& chart = hierarchy_.charts[number];
    IndexedChart indexed;
    indexed.sphere = in_space(chart.sphere);
    indexed.producer = chart.producer == no_group ? no_group : number_[chart.producer];
    indexed.faces = static_cast<uint32_t>(chart.face_count());
    indexed.box.low = indexed.box.high = indexed.sphere.centre;
    bool first = true;
    for_each_vertex(chart, [&](uint32_t v) {
      for (unsigned k = 0; k < 3; ++k) {
        const double x = positions_.origin[k] + static_cast<double>(positions_.numbers[size_t{3} * v + k]);
        const double low = x - positions_.rounding, high = x + positions_.rounding;
        indexed.box.low[k] = first ? low : std::min(indexed.box.low[k], low);
        indexed.box.high[k] = first ? high : std::max(indexed.box.high[k], high);
      }
      first = false;
    });
    return indexed;
  }

  /// Around all spheres' centres: radii may reach out of it.
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
    if (!(result_.frame.size > 0)) result_.frame.size = 1;
  }

  const Hierarchy& hierarchy_;
  const FaceLists& faces_;
  const LocalPositions& positions_;
  IndexedHierarchy result_;
  std::vector<uint32_t> number_;
};

}  // namespace

IndexedHierarchy index_hierarchy(const Hierarchy& hierarchy, const FaceLists& faces,
                                 const LocalPositions& positions) {
  return Indexer(hierarchy, faces, positions).run();
}

}  // namespace maille
