#pragma once

#include <maille/random_access.h>

#include <cmath>
#include <optional>
#include <vector>

#include "base/result.h"
#include "random/mesh_geometry.h"
#include "random/read/chart_queue.h"
#include "random/read/random_reader.h"

namespace maille {

/// How far a sphere or box is from a point.
struct FromPoint {
  Vector3 point;

  double operator()(const Sphere& sphere) const {
    const Vector3 d = sphere.centre - point;
    return std::max(std::sqrt(dot(d, d)) - sphere.radius, 0.0);
  }
  double operator()(const Box& box) const { return std::sqrt(squared_distance(point, box)); }
};

/// Calls look(place, chart) for charts of level 0, nearest first, as long as one may hold something that is
/// no farther than reach() says, which may shrink meanwhile.
template <class Distance, class Reach, class Look>
Result<> nearest_first(RandomReader& reader, Distance distance, Reach reach, Look look) {
  std::optional<ChartQueue<Distance>> queue(std::in_place, reader.index(), distance);
  while (const auto next = queue->next()) {
    if (next->distance > reach()) return {};
    if (next->missing) {
      const unsigned rebuilt = reader.rebuilt();
      MAILLE_CHECK(reader.load_index_pages({*next->missing}));
      // A damaged index was made anew, and the queue refers to groups of the old one.
      if (reader.rebuilt() != rebuilt) queue.emplace(reader.index(), distance);
      continue;
    }
    const std::vector<DecodedChart> chart = MAILLE_TRY(reader.read_charts({next->place}));
    look(next->place, chart[0]);
  }
  return {};
}

}  // namespace maille
