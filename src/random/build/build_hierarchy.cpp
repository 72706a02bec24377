#include "random/build/build_hierarchy.h"

#include <algorithm>

#include "base/result.h"
#include "random/build/level_builder.h"

namespace maille {
namespace {

class Builder {
 public:
  Builder(const FaceLists& faces, std::span<const float> positions, uint32_t vertices,
          const HierarchyOptions& options)
      : faces_(faces),
        positions_(positions.first(size_t{3} * vertices)),
        options_(options),
        executor_(options.executor == nullptr ? serial_executor() : *options.executor) {}

  Result<Hierarchy> run() {
    class_of_ = lowest_at_place(positions_);
    MAILLE_CHECK(report(0));
    result_.charts = cut_into_charts(faces_, {positions_, class_of_, {}}, options_.sizes, executor_);
    const uint64_t all = triangles_from(0);
    uint64_t before = all;
    for (uint32_t begin = 0, end = size(); end - begin > 1; begin = end, end = size()) {
      // The cut into charts is about a third of the work, each level a fourth of the one before.
      MAILLE_CHECK(report(1 - 0.67 * static_cast<double>(before) / static_cast<double>(all)));
      simplify_level(begin, end);
      const uint64_t after = triangles_from(end);
      // Little more can be removed: this level stays out, and several roots are left.
      if (!is_worth_a_level(before, after)) {
        drop_level(end);
        break;
      }
      before = after;
    }
    return std::move(result_);
  }

 private:
  uint32_t size() const { return static_cast<uint32_t>(result_.charts.size()); }
  /// Polygons count as the triangles that they become.
  uint64_t triangles_from(uint32_t begin) const {
    uint64_t count = 0;
    for (uint32_t i = begin; i < size(); ++i) count += count_triangles(faces_, result_.charts[i]);
    return count;
  }
  Result<> report(double fraction) const {
    if (!options_.progress || options_.progress({"levels of detail", std::min(fraction, 1.0)})) return {};
    return failure(ErrorCode::cancelled, "building levels of detail was cancelled");
  }

  void simplify_level(uint32_t begin, uint32_t end) {
    const uint32_t level = result_.charts[begin].level;
    auto groups = simplify_charts(faces_, {positions_, class_of_, {}, options_.corner_values},
                                  std::span(result_.charts).subspan(begin, end - begin), true, options_.sizes,
                                  executor_);
    for (SimplifiedGroup& group : groups) {
      for (uint32_t& input : group.inputs) input += begin;
      const uint32_t number =
          add_group(result_, level, std::move(group.inputs), group.view_error, group.bound);
      for (Chart& chart : group.outputs) {
        chart.level = level + 1;
        chart.producer = number;
        // A chart of which nothing is left still needs a place that its group encloses.
        if (chart.triangles.empty()) chart.sphere.centre = result_.groups[number].sphere.centre;
        result_.groups[number].outputs.push_back(size());
        result_.charts.push_back(std::move(chart));
      }
    }
  }

  /// Charts of the level before lose the groups that would have replaced them, and become roots.
  void drop_level(uint32_t begin) {
    const uint32_t level = result_.charts[begin - 1].level;
    result_.charts.resize(begin);
    std::erase_if(result_.groups, [level](const ChartGroup& group) { return group.level == level; });
    for (Chart& chart : result_.charts) {
      if (chart.level == level) chart.consumer = no_group;
    }
  }

  const FaceLists& faces_;
  std::span<const float> positions_;
  const HierarchyOptions& options_;
  Executor& executor_;
  Hierarchy result_;
  std::vector<uint32_t> class_of_;
};

}  // namespace

Result<Hierarchy> build_hierarchy(const FaceLists& faces, std::span<const float> positions, uint32_t vertices,
                                  const HierarchyOptions& options) {
  return Builder(faces, positions, vertices, options).run();
}

}  // namespace maille
