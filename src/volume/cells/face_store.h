#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "volume/cells/hull.h"

namespace maille {

/// Faces of any size, of polyhedra, and polygons that lie on none: what cells given by their faces are joined
/// to while they stream through. It stands beside the hull, which has cells with few faces of few corners.
/// Open faces are also a doubly linked row in the order in which they came, as cells that come breadth first
/// lie on the oldest ones.
///
/// As in the hull, faces around a point are a list through their corners, out of which nothing is taken: a
/// point leaves with its list, a face when its last point does, and the slot of a cell with its last face.
class FaceStore {
 public:
  struct Face {
    uint32_t begin = 0;  ///< of its corners
    uint32_t size = 0;
    uint32_t cell = no_slot;  ///< slot of the cell that brought it
    uint32_t live = 0;        ///< corners whose point is in memory
    // Closed faces leave the row; their links are stale and read by nobody.
    uint32_t before = no_slot, after = no_slot;  ///< open faces in the order in which they came
    uint64_t order = 0;                          ///< how many came before
    uint32_t asked_by = 0;                       ///< FaceCoder: the cell that was asked about it last
    uint8_t asked = 0;                           ///< and how often
    uint8_t open = 0;                            ///< no second cell has met it
    uint8_t passed = 0;                          ///< how often a face behind it was taken first
  };

  const Face& face(uint32_t id) const { return faces_[id]; }
  Face& face(uint32_t id) { return faces_[id]; }
  uint32_t point(uint32_t id, uint32_t place) const { return corners_[faces_[id].begin + place].point; }
  bool empty() const { return slots_.taken() == 0; }

  /// Enters a face of the cell in slot `cell`, which stays taken as long as one of its faces is there.
  /// `points` are in memory, and there is at least one.
  uint32_t add(std::span<const uint32_t> points, uint32_t cell) {
    const uint32_t id = slots_.take();
    if (id >= faces_.size()) faces_.resize(slots_.capacity());
    Face& face = faces_[id];
    const auto size = static_cast<uint32_t>(points.size());
    face = {};
    face.begin = take_corners(size);
    face.size = face.live = size;
    face.cell = cell;
    face.before = last_open_;
    face.order = counted_++;
    face.open = 1;
    (last_open_ == no_slot ? first_open_ : faces_[last_open_].after) = id;
    last_open_ = id;
    if (waiting_ == no_slot) waiting_ = id;
    for (uint32_t i = 0; i < size; ++i) enter(id, i, points[i]);
    if (cell >= faces_of_cell_.size()) faces_of_cell_.resize(cell + size_t{cell} / 2 + 16);
    ++faces_of_cell_[cell];
    return id;
  }

  /// Takes a face out of the row of open ones, once. Cursors that stand on it go on to the next.
  void close(uint32_t id) {
    Face& face = faces_[id];
    if (face.open == 0) return;
    face.open = 0;
    (face.before == no_slot ? first_open_ : faces_[face.before].after) = face.after;
    (face.after == no_slot ? last_open_ : faces_[face.after].before) = face.before;
    if (waiting_ == id) waiting_ = face.after;
    if (next_below_ == id) next_below_ = face.after;
  }

  /// The point ends: all faces at it close and lose this corner; those without corners are gone, and with the
  /// last face of a cell its slot in the hull.
  void remove_point(uint32_t slot, Hull& hull) {
    if (slot >= heads_.size()) return;
    for (uint32_t at = heads_[slot]; at != no_slot;) {
      Corner& corner = corners_[at];
      at = corner.next;
      corner.point = no_slot;
      close(corner.face);
      if (--faces_[corner.face].live == 0) remove(corner.face, hull);
    }
    heads_[slot] = no_slot;
  }

  /// Calls visit(face, place of the point in it) for the faces around a point, the newest first, until it
  /// returns true. Unlike Hull::around() it has no limit of its own: callers count.
  template <class Visit>
  bool around(uint32_t slot, Visit visit) const {
    if (slot >= heads_.size()) return false;
    for (uint32_t at = heads_[slot]; at != no_slot;) {
      const Corner& corner = corners_[at];
      if (visit(corner.face, at - faces_[corner.face].begin)) return true;
      at = corner.next;
    }
    return false;
  }

  /// The oldest open face that others were not taken before too often, and those behind it. Faces that were
  /// passed over more than twice, such as those at the border of the mesh, never come first again, so that
  /// the row's head does not fill up with them.
  uint32_t first_waiting() {
    while (waiting_ != no_slot && faces_[waiting_].passed > most_passed) waiting_ = faces_[waiting_].after;
    return waiting_;
  }
  /// Polygons that lie on faces of solids mostly do so in the order of these faces.
  uint32_t next_below() const { return next_below_ != no_slot ? next_below_ : first_open_; }
  void set_next_below(uint32_t id) { next_below_ = faces_[id].after; }

  uint64_t bytes() const {
    return bytes_held(faces_) + bytes_held(corners_) + bytes_held(heads_) + bytes_held(faces_of_cell_);
  }

 private:
  // Chosen with the first version (032247f), no sweep is on record: with 0 one cell out of order loses the
  // face for good, with many the four questions are spent on border faces. Part of the format.
  static constexpr unsigned most_passed = 2;
  struct Corner {
    uint32_t point = no_slot;
    uint32_t next = no_slot;
    uint32_t face = 0;
  };

  void enter(uint32_t id, uint32_t place, uint32_t slot) {
    if (slot >= heads_.size()) heads_.resize(slot + size_t{slot} / 2 + 16, no_slot);
    const uint32_t at = faces_[id].begin + place;
    corners_[at] = {slot, heads_[slot], id};
    heads_[slot] = at;
  }
  void remove(uint32_t id, Hull& hull) {
    const Face& face = faces_[id];
    free_[class_of(face.size)].push_back(face.begin);
    slots_.give_back(id);
    if (--faces_of_cell_[face.cell] == 0) hull.give_back_cell(face.cell);
  }
  /// Room for corners comes in powers of two, each with a list of what is free again: at most half is wasted,
  /// and nothing is moved. Sizes are below 2^22, so that 32 lists are more than enough.
  static unsigned class_of(uint32_t size) {
    unsigned c = 0;
    while (uint32_t{1} << c < size) ++c;
    return c;
  }
  uint32_t take_corners(uint32_t size) {
    std::vector<uint32_t>& free = free_[class_of(size)];
    if (free.empty()) {
      corners_.resize(corners_.size() + (size_t{1} << class_of(size)));
      return static_cast<uint32_t>(corners_.size() - (size_t{1} << class_of(size)));
    }
    const uint32_t begin = free.back();
    free.pop_back();
    return begin;
  }

  std::vector<Face> faces_;
  std::vector<Corner> corners_;
  std::array<std::vector<uint32_t>, 32> free_;
  std::vector<uint32_t> heads_;          ///< by slot of point
  std::vector<uint32_t> faces_of_cell_;  ///< by slot of cell
  Slots slots_;
  uint32_t first_open_ = no_slot, last_open_ = no_slot, waiting_ = no_slot, next_below_ = no_slot;
  uint64_t counted_ = 0;
};

}  // namespace maille
