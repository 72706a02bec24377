#include "volume/pieces/point_sharing.h"

#include <algorithm>
#include <tuple>

#include "base/result.h"
#include "volume/order/working_memory.h"

namespace maille {
namespace {

/// A shared point, on the way to those in the same place. It is written to a file as it is, and read by the
/// same process.
struct PlacedPoint {
  Place place;
  uint64_t number;
  bool operator<(const PlacedPoint& other) const {
    return std::tie(place, number) < std::tie(other.place, other.number);
  }
};

/// Points with the same place meet in one of some lists, each of which is sorted in memory: a 64th of the
/// shared points at once, as places are spread by a hash.
constexpr size_t place_lists = 64;
size_t list_of(const Place& place) {
  uint64_t mixed = 0;
  for (const uint64_t bits : place) mixed = (mixed ^ bits) * 0x9e3779b97f4a7c15 ^ mixed >> 29;
  return static_cast<size_t>(mixed >> 58);
}

/// Adds to `copies` the points of one list that are not the first in their place, by number: copies are
/// counted from 0 in that order.
Result<> find_copies(ScratchLists& places, size_t list, std::vector<std::pair<uint32_t, uint32_t>>& copies) {
  const std::vector<std::byte> bytes = MAILLE_TRY(places.read(list));
  std::vector<PlacedPoint> points(bytes.size() / sizeof(PlacedPoint));
  std::copy(bytes.begin(), bytes.end(), std::as_writable_bytes(std::span(points)).begin());
  std::sort(points.begin(), points.end());
  uint32_t copy = 0;
  for (size_t i = 1; i < points.size(); ++i) {
    copy = points[i].place == points[i - 1].place ? copy + 1 : 0;
    if (copy > 0) copies.emplace_back(static_cast<uint32_t>(points[i].number), copy);
  }
  return {};
}

/// The range of points that is looked at: which were seen, and which once more.
class PointRange {
 public:
  explicit PointRange(uint64_t points) : seen_((points + 63) / 64), again_(seen_.size()) {}
  void begin(uint64_t first) {
    first_ = first;
    std::fill(seen_.begin(), seen_.end(), 0);
    std::fill(again_.begin(), again_.end(), 0);
  }
  void add(uint64_t number) {
    const uint64_t bit = uint64_t{1} << (number - first_) % 64;
    uint64_t& word = seen_[(number - first_) / 64];
    if ((word & bit) != 0) again_[(number - first_) / 64] |= bit;
    word |= bit;
  }
  bool is_seen(uint64_t number) const { return has(seen_, number); }
  bool is_shared(uint64_t number) const { return has(again_, number); }

 private:
  bool has(const std::vector<uint64_t>& bits, uint64_t number) const {
    return (bits[(number - first_) / 64] >> (number - first_) % 64 & 1) != 0;
  }
  std::vector<uint64_t> seen_, again_;
  uint64_t first_ = 0;
};

/// All lists side by side, each as far as a range reaches. A list is read once in all, however many ranges
/// there are.
class SideBySide {
 public:
  SideBySide(ScratchLists& lists, size_t buffer) {
    for (size_t i = 0; i < lists.count(); ++i) cursors_.push_back({RisingCursor(lists, i, buffer)});
  }
  /// visit(list, number, place in the list) -> Result<>, for all numbers below `end` that were not visited.
  template <class Visit>
  Result<> visit_below(uint64_t end, Visit visit) {
    for (size_t i = 0; i < cursors_.size(); ++i) {
      Position& at = cursors_[i];
      if (!at.begun) at.more = MAILLE_TRY(at.cursor.next());
      at.begun = true;
      for (; at.more && at.cursor.number() < end; ++at.place) {
        MAILLE_CHECK(visit(i, at.cursor.number(), at.place));
        at.more = MAILLE_TRY(at.cursor.next());
      }
    }
    return {};
  }

 private:
  struct Position {
    RisingCursor cursor;
    uint64_t place = 0;
    bool begun = false, more = false;
  };
  std::vector<Position> cursors_;
};

}  // namespace

Result<PointSharing> PointSharing::find(ScratchLists& points, uint64_t count, const WorkingSpace& space,
                                        const PlaceOf& place_of) {
  const uint64_t memory = working_memory(space);
  PointSharing found(MAILLE_TRY(ScratchLists::create(space.folder, points.count(), memory / 8)),
                     MAILLE_TRY(ScratchLists::create(space.folder, 1, 0)));
  ScratchLists places = MAILLE_TRY(ScratchLists::create(space.folder, place_lists, memory / 16));
  const uint64_t step = std::max<uint64_t>(memory, 256);  // points: with two bits each a quarter of it
  const size_t buffer = std::clamp<size_t>(memory / 16 / std::max<size_t>(points.count(), 1), 64, 8192);
  SideBySide first(points, buffer), second(points, buffer);
  std::vector<RisingWriter> shared;
  constexpr size_t few = 64, many = 4096;
  for (size_t i = 0; i < points.count(); ++i) shared.emplace_back(found.shared_, i, few);
  RisingWriter unused(found.unused_, 0, many);
  PointRange range(std::min(step, count));
  for (uint64_t begin = 0; begin < count; begin += step) {
    // Twice over the lists for each range: what is shared is known only when all were seen.
    const uint64_t end = std::min(begin + step, count);
    range.begin(begin);
    MAILLE_CHECK(first.visit_below(end, [&](size_t, uint64_t number, uint64_t) -> Result<> {
      range.add(number);
      return {};
    }));
    MAILLE_CHECK(second.visit_below(end, [&](size_t piece, uint64_t number, uint64_t place) -> Result<> {
      return range.is_shared(number) ? shared[piece].add(place) : Result<>();
    }));
    for (uint64_t number = begin; number < end; ++number) {
      if (!range.is_seen(number)) MAILLE_CHECK(unused.add(number));
      if (!range.is_shared(number)) continue;
      const PlacedPoint placed = {MAILLE_TRY(place_of(number)), number};
      MAILLE_CHECK(places.append(list_of(placed.place), std::as_bytes(std::span(&placed, 1))));
    }
  }
  for (RisingWriter& each : shared) MAILLE_CHECK(each.finish());
  MAILLE_CHECK(unused.finish());
  MAILLE_CHECK(found.shared_.finish());
  MAILLE_CHECK(found.unused_.finish());
  found.unused_count_ = unused.count();
  for (size_t list = 0; list < place_lists; ++list) MAILLE_CHECK(find_copies(places, list, found.copies_));
  std::sort(found.copies_.begin(), found.copies_.end());
  return found;
}

// Only points that are not the first in their place are listed.
uint32_t PointSharing::copy_of(uint32_t point) const {
  const auto at = std::lower_bound(copies_.begin(), copies_.end(), std::pair(point, 0u));
  return at != copies_.end() && at->first == point ? at->second : 0;
}

Result<std::vector<SharedPoint>> PointSharing::shared_of(size_t piece, std::span<const uint32_t> points) {
  std::vector<SharedPoint> shared;
  for (const uint32_t place : MAILLE_TRY(read_rising(shared_, piece)))
    shared.push_back({place, copy_of(points[place])});
  return shared;
}

Result<std::vector<uint32_t>> PointSharing::next_unused(uint64_t most) {
  constexpr size_t buffer = 8192;
  std::vector<uint32_t> points;
  if (!next_unused_) next_unused_.emplace(unused_, 0, buffer);
  while (points.size() < most && MAILLE_TRY(next_unused_->next()))
    points.push_back(static_cast<uint32_t>(next_unused_->number()));
  return points;
}

}  // namespace maille
