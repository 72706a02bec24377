#include "random/read/selection.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <set>
#include <unordered_map>

#include "random/mesh_geometry.h"

namespace maille {
namespace {

double length(const Vector3& v) {
  return std::sqrt(dot(v, v));
}

/// The error in pixels, as seen from the nearest point of the group's sphere; infinite within the sphere.
/// Spheres enclose those of finer groups, so this never rises from a group to those that refine it, and
/// selections have no cracks.
double seen_error(const View& view, const IndexedGroup& group) {
  const double distance = length(group.sphere.centre - view.eye) - group.sphere.radius;
  return distance > 0 ? group.view_error / distance * view.pixels_per_radian
                      : std::numeric_limits<double>::infinity();
}

/// Collects the pages of the index that a selection needs and does not have. The caller loads them and asks
/// again.
class Missing {
 public:
  explicit Missing(const ChartIndex& index) : index_(index) {}
  bool has(uint32_t group) {
    const uint32_t page = ChartIndex::page_of(group);
    if (index_.has_page(page)) return true;
    pages_.insert(page);
    return false;
  }
  std::vector<uint32_t> pages() const { return {pages_.begin(), pages_.end()}; }

 private:
  const ChartIndex& index_;
  std::set<uint32_t> pages_;
};

bool before(const ChartPlace& a, const ChartPlace& b) {
  return a.group != b.group ? a.group < b.group : a.chart < b.chart;
}

}  // namespace

bool is_too_coarse(const IndexedGroup& group, const Detail& detail) {
  return group.bound > detail.bound || group.view_error > detail.view_error || group.level >= detail.level ||
         (detail.view && seen_error(*detail.view, group) > detail.view->pixels);
}

Selection select(const ChartIndex& index, const Region& region, const Detail& detail) {
  Selection selection;
  Missing missing(index);
  // A group is refined where any of the charts that it replaces is, and all ask the same question of it.
  std::vector<bool> visited(index.size());
  std::vector<uint32_t> waiting;
  const auto visit = [&](uint32_t group) {
    if (!visited[group]) waiting.push_back(group);
    visited[group] = true;
  };
  if (index.size() > 0) visit(0);
  while (!waiting.empty()) {
    const uint32_t number = waiting.back();
    waiting.pop_back();
    if (!missing.has(number)) continue;
    const IndexedGroup& group = index.group(number);
    for (uint32_t i = 0; i < group.charts.size(); ++i) {
      const IndexedChart& chart = group.charts[i];
      if (chart.producer != no_group) {
        if (visited[chart.producer] || !missing.has(chart.producer)) continue;
        const IndexedGroup& finer = index.group(chart.producer);
        if (is_too_coarse(finer, detail)) {
          // Where the region does not meet the finer group nothing of it is wanted, nor of the coarse chart.
          if (region.meets(finer.sphere)) visit(chart.producer);
          continue;
        }
      }
      if (!region.meets(chart.sphere) || !region.meets(chart.box)) continue;
      selection.charts.push_back({number, i});
      selection.faces += chart.faces;
    }
  }
  std::sort(selection.charts.begin(), selection.charts.end(), before);
  selection.missing = missing.pages();
  return selection;
}

namespace {

/// A cut that is refined group by group, the worst first.
class GrowingCut {
 public:
  GrowingCut(const ChartIndex& index, const Region& region, const std::optional<View>& view)
      : index_(index), region_(region), view_(view), missing_(index), refined_(index.size()) {}

  Selection run(uint64_t most_faces) {
    if (index_.size() > 0 && missing_.has(0)) refine(0);
    while (!candidates_.empty()) {
      const uint32_t group = candidates_.top().group;
      // A hostile index offers a group again and again.
      if (refined_[group]) {
        candidates_.pop();
        continue;
      }
      // The worst group that does not fit ends the search: refining a better one instead would spend the
      // faces where they matter less.
      if (faces_ - replaced_[group].faces + faces_of(group) > most_faces) break;
      candidates_.pop();
      refine(group);
    }
    return take();
  }

 private:
  struct Candidate {
    double error;
    uint32_t group;
    // The queue gives the largest first; of equal errors the lower group comes first, so that the order is
    // total.
    bool operator<(const Candidate& o) const { return error != o.error ? error < o.error : group > o.group; }
  };
  /// Of a group that is not refined: the charts of the cut that it would replace.
  struct Replaced {
    uint32_t charts = 0;
    uint64_t faces = 0;
  };

  bool meets(const IndexedChart& chart) const {
    return region_.meets(chart.sphere) && region_.meets(chart.box);
  }
  uint64_t faces_of(uint32_t number) const {
    uint64_t faces = 0;
    for (const IndexedChart& chart : index_.group(number).charts) faces += meets(chart) ? chart.faces : 0;
    return faces;
  }
  void refine(uint32_t number) {
    refined_[number] = true;
    faces_ += faces_of(number);
    faces_ -= replaced_[number].faces;
    for (const IndexedChart& chart : index_.group(number).charts) {
      if (chart.producer == no_group) continue;
      Replaced& replaced = replaced_[chart.producer];
      ++replaced.charts;
      replaced.faces += meets(chart) ? chart.faces : 0;
      if (missing_.has(chart.producer)) offer(chart.producer, replaced.charts);
    }
  }
  /// A group becomes a candidate when all charts that it replaces are in the cut. Replacing only some of them
  /// would leave cracks.
  void offer(uint32_t number, uint32_t charts) {
    const IndexedGroup& group = index_.group(number);
    if (charts < group.replaces || !region_.meets(group.sphere)) return;
    candidates_.push({view_ ? seen_error(*view_, group) : group.view_error, number});
  }

  Selection take() {
    Selection selection;
    for (uint32_t number = 0; number < refined_.size(); ++number) {
      if (!refined_[number]) continue;
      const std::vector<IndexedChart>& charts = index_.group(number).charts;
      for (uint32_t i = 0; i < charts.size(); ++i) {
        const bool replaced = charts[i].producer != no_group && refined_[charts[i].producer];
        if (!replaced && meets(charts[i])) selection.charts.push_back({number, i});
      }
    }
    selection.faces = faces_;
    selection.missing = missing_.pages();
    return selection;
  }

  const ChartIndex& index_;
  const Region& region_;
  const std::optional<View>& view_;
  Missing missing_;
  std::vector<bool> refined_;
  std::unordered_map<uint32_t, Replaced> replaced_;
  std::priority_queue<Candidate> candidates_;
  uint64_t faces_ = 0;
};

}  // namespace

Selection select_within(const ChartIndex& index, const Region& region, uint64_t most_faces,
                        const std::optional<View>& view) {
  return GrowingCut(index, region, view).run(most_faces);
}

}  // namespace maille
