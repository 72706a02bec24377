#pragma once

#include <cmath>
#include <optional>
#include <queue>
#include <vector>

#include <maille/random_access.h>

#include "random/chart_index.h"

namespace maille {

/// Charts of level 0, nearest first. `Distance` gives for a sphere or a box a number that nothing in it is
/// nearer than; infinite: not wanted.
template <class Distance>
class ChartQueue {
 public:
  ChartQueue(const ChartIndex& index, Distance distance)
      : index_(index), distance_(distance), seen_(index.size()) {
    if (index.size() > 0) add_group(0, 0);
  }
  struct Next {
    double distance;
    ChartPlace place;
    std::optional<uint32_t> missing;  ///< a page of the index that must be read first; then ask again
  };
  /// Nothing at the end.
  std::optional<Next> next() {
    while (!items_.empty()) {
      const Item item = items_.top();
      if (!item.is_group) {
        items_.pop();
        return Next{item.distance, item.place, {}};
      }
      const uint32_t page = ChartIndex::page_of(item.place.group);
      if (!index_.has_page(page)) return Next{item.distance, item.place, page};
      items_.pop();
      open(item.place.group);
    }
    return std::nullopt;
  }

 private:
  struct Item {
    double distance;
    bool is_group;
    ChartPlace place;
    bool operator<(const Item& o) const {
      if (distance != o.distance) return distance > o.distance;
      if (is_group != o.is_group) return is_group < o.is_group;
      return place.group != o.place.group ? place.group > o.place.group : place.chart > o.place.chart;
    }
  };
  void add_group(uint32_t group, double distance) {
    if (!seen_[group]) items_.push({distance, true, {group, 0}});
    seen_[group] = true;
  }
  void open(uint32_t number) {
    const IndexedGroup& group = index_.group(number);
    const double to_group = number == 0 ? 0 : distance_(group.sphere);
    if (std::isinf(to_group)) return;
    for (uint32_t i = 0; i < group.charts.size(); ++i) {
      const IndexedChart& chart = group.charts[i];
      if (chart.producer != no_group) {
        // What it encloses is not known before it is read; no nearer than this group.
        add_group(chart.producer, to_group);
        continue;
      }
      const double distance = std::max(distance_(chart.sphere), distance_(chart.box));
      if (!std::isinf(distance)) items_.push({distance, false, {number, i}});
    }
  }

  const ChartIndex& index_;
  Distance distance_;
  std::vector<bool> seen_;
  std::priority_queue<Item> items_;
};

}  // namespace maille
