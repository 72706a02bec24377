#include "random/read/nearest_points.h"

#include <algorithm>
#include <limits>
#include <set>
#include <tuple>

#include "random/read/join_charts.h"
#include "random/read/nearest_first.h"

namespace maille {
namespace {

bool is_nearer(const NearPoint& a, const NearPoint& b) {
  return std::tie(a.distance, a.chart.group, a.chart.chart, a.point) <
         std::tie(b.distance, b.chart.group, b.chart.chart, b.point);
}

/// The nearest points of the charts looked at.
class NearestPoints {
 public:
  NearestPoints(const Vector3& from, uint64_t count) : from_(from), count_(count) {}

  /// No point farther than this can be among the nearest; charts beyond it are not read.
  double reach() const {
    return heap_.size() < count_ ? std::numeric_limits<double>::infinity() : heap_.front().distance;
  }
  void look(const ChartPlace& place, const DecodedChart& chart) {
    auto shared = chart.shared.begin();
    // Where loose points are the index does not say.
    std::vector<bool> used(chart.mesh.point_count());
    for (const CellBlock& block : chart.mesh.blocks) {
      for (const uint32_t point : block.connectivity) used[point] = true;
    }
    for (uint32_t i = 0; i < used.size(); ++i) {
      if (!used[i]) continue;
      while (shared != chart.shared.end() && shared->point < i) ++shared;
      const Vector3 position = point_position(chart.mesh.points, i), d = position - from_;
      const double distance = std::sqrt(dot(d, d));
      // Also where it is no number.
      if (!(heap_.size() < count_ ? std::isfinite(distance) : distance < reach())) continue;
      const bool is_shared = shared != chart.shared.end() && shared->point == i;
      if (is_shared && !seen_.insert({place_of(chart.mesh.points, i), shared->copy}).second) continue;
      add({place, i, position, distance});
    }
  }
  std::vector<NearPoint> take() {
    std::sort_heap(heap_.begin(), heap_.end(), is_nearer);
    return std::move(heap_);
  }

 private:
  /// A heap with the farthest point on top: the one that leaves if there are too many.
  void add(const NearPoint& point) {
    heap_.push_back(point);
    std::push_heap(heap_.begin(), heap_.end(), is_nearer);
    if (heap_.size() <= count_) return;
    std::pop_heap(heap_.begin(), heap_.end(), is_nearer);
    heap_.pop_back();
  }

  Vector3 from_;
  uint64_t count_;
  std::vector<NearPoint> heap_;                ///< the farthest first
  std::set<std::pair<Place, uint32_t>> seen_;  ///< those that several charts have
};

}  // namespace

Result<std::vector<NearPoint>> nearest_points(RandomReader& reader, const Vector3& point, uint64_t count) {
  if (count == 0) return std::vector<NearPoint>();
  NearestPoints nearest(point, count);
  MAILLE_CHECK(nearest_first(
      reader, FromPoint{point}, [&] { return nearest.reach(); },
      [&](const ChartPlace& place, const DecodedChart& chart) { nearest.look(place, chart); }));
  return nearest.take();
}

}  // namespace maille
