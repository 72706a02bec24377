#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "surface/parts/shared_points.h"
#include "volume/pieces/piece_layout.h"

namespace maille {

/// The numbers that pieces gave their shared points, for those that come later. A point is forgotten behind
/// the last piece whose box it may be in: memory is for the points between pieces that were and pieces to
/// come.
class SharedNumbers {
 public:
  explicit SharedNumbers(const std::vector<PieceRecord>& pieces);

  /// The number of the point if an earlier piece had it; else `next` is its number from now on. `at`: where
  /// it is.
  uint64_t find_or_add(const Place& place, uint32_t copy, const std::array<double, 3>& at, uint64_t next);
  /// Pieces end in their order.
  void end_piece(uint32_t piece);

 private:
  struct Key {
    Place place;
    uint32_t copy;
    bool operator==(const Key& other) const { return place == other.place && copy == other.copy; }
  };
  struct Hash {
    size_t operator()(const Key& key) const;
  };
  size_t cell_of(const std::array<double, 3>& at) const;
  uint32_t step_of(double coordinate, unsigned axis) const;

  std::unordered_map<Key, uint64_t, Hash> numbers_;  ///< only looked up
  std::vector<std::vector<Key>> ends_;               ///< by piece, what is forgotten behind it
  // A coarse lattice over all boxes, with the last piece whose box meets each of its cells.
  uint32_t side_ = 1;
  std::array<double, 3> low_{}, scale_{};
  std::vector<uint32_t> last_;
};

}  // namespace maille
