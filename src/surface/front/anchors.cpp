#include "surface/front/anchors.h"

#include <algorithm>
#include <cmath>

#include "surface/half_edges.h"

namespace maille {
namespace {

/// Known places sorted by the cell of a grid that they lie in.
class Grid {
 public:
  explicit Grid(std::span<const Vector3> known) : known_(known) {
    Vector3 high = low_ = known[0];
    for (const Vector3& place : known) {
      for (unsigned k = 0; k < 3; ++k) {
        low_[k] = std::min(low_[k], place[k]);
        high[k] = std::max(high[k], place[k]);
      }
    }
    double side = 0;
    for (unsigned k = 0; k < 3; ++k) side = std::max(side, high[k] - low_[k]);
    // A surface has about one place in each cell that it goes through.
    const double across = std::min(std::sqrt(static_cast<double>(known.size())), 1000.0);
    inverse_cell_ = side > 0 && side < 1e300 ? across / side : 0;
    for (uint32_t i = 0; i < known.size(); ++i) entries_.push_back({key(cell_of(known[i])), i});
    std::sort(entries_.begin(), entries_.end());
  }

  /// Looks at the cells around, farther and farther; `otherwise` where nothing is found soon.
  uint32_t nearest(const Vector3& place, uint32_t otherwise) const {
    const auto centre = cell_of(place);
    double best = INFINITY;
    uint32_t found = otherwise;
    for (int32_t radius = 0; radius <= most_radius; ++radius) {
      for (int32_t x = -radius; x <= radius; ++x) {
        for (int32_t y = -radius; y <= radius; ++y) {
          const bool inside = std::max(std::abs(x), std::abs(y)) < radius;
          for (int32_t z = -radius; z <= radius; z += inside && radius > 0 ? 2 * radius : 1)
            look_into({centre[0] + x, centre[1] + y, centre[2] + z}, place, best, found);
        }
      }
      if (std::sqrt(best) * inverse_cell_ <= radius) break;
    }
    return found;
  }

 private:
  static constexpr int32_t most_radius = 6;
  using Cell = std::array<int32_t, 3>;
  struct Entry {
    uint64_t key;
    uint32_t place;
    bool operator<(const Entry& other) const {
      return key != other.key ? key < other.key : place < other.place;
    }
  };

  Cell cell_of(const Vector3& place) const {
    Cell cell;
    for (unsigned k = 0; k < 3; ++k) {
      const double scaled = (place[k] - low_[k]) * inverse_cell_;
      cell[k] = scaled > -10 ? scaled < 2000 ? static_cast<int32_t>(std::floor(scaled)) : 2000 : -10;
    }
    return cell;
  }
  static uint64_t key(const Cell& cell) {
    uint64_t key = 0;
    for (const int32_t c : cell) key = key << 16 | static_cast<uint64_t>(c + 100);
    return key;
  }
  void look_into(const Cell& cell, const Vector3& place, double& best, uint32_t& found) const {
    const uint64_t wanted = key(cell);
    auto entry = std::lower_bound(entries_.begin(), entries_.end(), Entry{wanted, 0});
    for (unsigned i = 0; i < 64 && entry != entries_.end() && entry->key == wanted; ++entry, ++i) {
      const Vector3 apart = known_[entry->place] - place;
      const double square = dot(apart, apart);
      if (!(square < best)) continue;
      best = square;
      found = entry->place;
    }
  }

  std::span<const Vector3> known_;
  Vector3 low_;
  double inverse_cell_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace

std::vector<uint32_t> find_anchors(std::span<const Vector3> known, std::span<const Vector3> places) {
  std::vector<uint32_t> anchors(places.size(), none);
  if (known.empty() || places.empty()) return anchors;
  const Grid grid(known);
  uint32_t newest = 0;
  for (size_t i = 0; i < places.size(); ++i) anchors[i] = newest = grid.nearest(places[i], newest);
  return anchors;
}

}  // namespace maille
