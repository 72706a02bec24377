#pragma once

#include <maille/out_of_core.h>

#include <functional>
#include <optional>
#include <vector>

#include "surface/parts/shared_points.h"
#include "volume/pieces/scratch_lists.h"

namespace maille {

/// Which points of pieces others have as well, out of core. All lists rise, so that one pass over them, all
/// side by side, tells it for one range of points after the other: a range is as large as memory for two bits
/// a point. Only what is shared goes on to be told apart by place.
class PointSharing {
 public:
  /// The position of a point as decoders will have it.
  using PlaceOf = std::function<Result<Place>(uint64_t point)>;

  /// `points`: by piece the numbers of its points in the mesh, which has so many.
  static Result<PointSharing> find(ScratchLists& points, uint64_t count, const WorkingSpace& space,
                                   const PlaceOf& place_of);

  /// Points of a piece that others have as well, by their places in its list, rising. Of several points in
  /// one place that are shared each has a copy of its own, in the order of their numbers.
  Result<std::vector<SharedPoint>> shared_of(size_t piece, std::span<const uint32_t> points);

  /// How many points no piece has.
  uint64_t unused() const { return unused_count_; }
  /// So many of them at most, behind those that this gave before; rising.
  Result<std::vector<uint32_t>> next_unused(uint64_t most);

 private:
  PointSharing(ScratchLists shared, ScratchLists unused)
      : shared_(std::move(shared)), unused_(std::move(unused)) {}
  uint32_t copy_of(uint32_t point) const;

  ScratchLists shared_, unused_;
  uint64_t unused_count_ = 0;
  std::optional<RisingCursor> next_unused_;
  /// Of points that share their place with others before them: number and copy, by number.
  std::vector<std::pair<uint32_t, uint32_t>> copies_;
};

}  // namespace maille
