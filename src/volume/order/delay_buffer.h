#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "volume/cells/cell_shape.h"

namespace maille {

/// A cell that is held back, as it was given: one place of the buffer, whose vectors keep their room.
struct DelayedCell {
  unsigned kind = 0;
  CellType type = CellType::vertex;
  std::vector<uint64_t> numbers;  ///< of its points
  std::vector<uint8_t> last_use;  ///< one for each of these
  std::vector<uint32_t> face_sizes;
  std::vector<std::byte> values;
};

/// Puts the cells of a stream in a better order as they come, with memory for so many of them: the next one
/// is always that which most faces of the front wait for; of equals the one that the front reached first, or,
/// of tetrahedra, the one that came first; where no face of the front is one of a cell that is here, the
/// oldest. (Isenburg and others, "Streaming Compression of Tetrahedral Volume Meshes", 2006, hold tetrahedra
/// back in such a way.) By age tetrahedra in a good order stay so: 5.6 bits, where what the front reached
/// first, or last as in front_order(), makes 8.4 and 6.1 of them with room for 10,000 cells.
///
/// Faces are known by a hash of their points: where two have the same one the order is a little worse.
class DelayBuffer {
 public:
  explicit DelayBuffer(uint64_t most_cells) : most_(most_cells) {}

  bool is_full() const { return count_ >= most_; }
  bool is_empty() const { return count_ == 0; }
  /// Room for one cell, to be filled in before enter(). Not if full.
  DelayedCell& next();
  void enter();
  /// The best cell, which leaves. Its last uses are those of the new order. Not if empty; valid until next().
  const DelayedCell& take();
  /// Notes that no cell to come has the point. False: none that waits has it either, so that the end is to be
  /// told otherwise.
  bool end(uint64_t number);

 private:
  static constexpr uint32_t none = 0xffffffff;
  struct Place {
    DelayedCell cell;
    std::array<uint64_t, most_faces> face{};
    uint64_t serial = 0;  ///< of the cells as they came; 0: nobody is here
    uint64_t rank = 0;    ///< lower ones first, where as many faces wait
    uint32_t faces_waiting = 0;
    uint32_t older = none, younger = none;
  };
  /// The cells that wait with this face (two at most), and whether one that is gone has it.
  struct Face {
    std::array<uint32_t, 2> place{none, none};
    uint64_t point = 0;
    bool on_front = false;
  };
  struct Point {
    uint32_t cells = 0;  ///< that wait
    bool ended = false;
  };
  /// An entry of the heap; out of date as soon as the cell has another number of waiting faces, or is gone.
  struct Candidate {
    uint32_t faces;
    uint64_t rank;
    uint64_t serial;
    uint32_t place;
    bool operator<(const Candidate& other) const {
      if (faces != other.faces) return faces < other.faces;
      return rank != other.rank ? rank > other.rank : serial > other.serial;
    }
  };

  const CellShape* shape_at(uint32_t place) const;
  void find_faces(Place& place) const;
  void meet_front(uint32_t place);
  void reach(Place& place) const;
  uint32_t choose();
  void leave_list(uint32_t place);
  void move_front(uint32_t place);
  void mark_ends(DelayedCell& cell);
  void forget_old_faces();
  bool is_current(const Candidate& candidate) const;

  uint64_t most_;
  uint64_t count_ = 0, serial_ = 0, taken_ = 0;
  std::vector<Place> places_;
  std::vector<uint32_t> free_;
  uint32_t filled_ = none, left_ = none;  ///< the place given by next(), and that of the cell taken last
  uint32_t oldest_ = none, youngest_ = none;
  std::unordered_map<uint64_t, Face> faces_;    ///< looked up, and swept without regard to its order
  std::unordered_map<uint64_t, Point> points_;  ///< that are used, and will be; only looked up
  size_t kept_faces_ = 0;                       ///< after the last sweep
  std::vector<Candidate> queue_;                ///< a heap
};

}  // namespace maille
