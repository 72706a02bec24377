#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "surface/parts/shared_points.h"
#include "volume/pieces/piece_layout.h"

namespace maille {

/// Finds the last piece whose box has a point. Pieces that follow one another lie together, so a binary tree
/// over their numbers, with a box for each node, is a good one. Boxes come from the index, which may be
/// damaged: a wrong box makes a point forgotten too early, and then the mesh has more points than its file
/// says.
class LastPieces {
 public:
  explicit LastPieces(const std::vector<PieceRecord>& pieces);
  /// That piece, or a later one where boxes lie so badly that the search is given up. 0: no box has it.
  uint32_t last_with(const std::array<double, 3>& at) const;

 private:
  struct Box {
    std::array<float, 3> low{1, 1, 1}, high{0, 0, 0};
    bool has(const std::array<double, 3>& at) const;
    void add(const Box& other);
  };
  uint32_t leaves_ = 1;     ///< a power of two; pieces, then empty boxes
  std::vector<Box> boxes_;  ///< node n has 2n and 2n + 1 under it; the root is 1
};

/// The numbers that pieces gave their shared points, for those that come later. A point is forgotten behind
/// the last piece whose box it may be in: memory is for the points between pieces that were and pieces to
/// come, about 40 bytes each.
///
/// A point is known by 96 bits of a hash of its place: of a billion, two are alike once in 2^37 meshes, and
/// then the mesh has fewer points than its file says.
class SharedNumbers {
 public:
  explicit SharedNumbers(const std::vector<PieceRecord>& pieces);

  /// The number of the point if an earlier piece had it; else `next` is its number from now on. `at`: where
  /// it is.
  uint64_t find_or_add(const Place& place, uint32_t copy, const std::array<double, 3>& at, uint64_t next);
  /// Pieces end in their order.
  void end_piece(uint32_t piece) { piece_ = piece + 1; }
  /// Points there is room for.
  size_t capacity() const;

 private:
  static constexpr uint32_t none = 0xffffffff;
  struct Entry {
    uint64_t hash = 0, number = 0;
    uint32_t more_hash = 0, last = none;  ///< the last piece that may have it; none: no entry
  };
  /// Entries by their hashes, or at the next place that was free. Those forgotten stay until there is no
  /// room.
  struct Table {
    std::vector<Entry> entries;
    size_t used = 0;
  };
  static Entry& find(Table& table, uint64_t hash, uint32_t more_hash);
  /// Grows the table, or only drops entries that are forgotten, if that is enough.
  void make_room(Table& table) const;

  LastPieces last_pieces_;
  uint32_t pieces_;
  uint32_t piece_ = 0;
  std::array<Table, 64> tables_;  ///< several, so that a small part is there twice while one grows
};

}  // namespace maille
