#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/held_bytes.h"
#include "code/most_around.h"
#include "volume/cells/cell_shape.h"
#include "volume/cells/point_table.h"
#include "volume/cells/slots.h"

namespace maille {

/// A cell that may have left memory since: its slot may hold another cell by now, which has another ordinal.
/// Ordinals wrap after 2^32 cells; a reference that old would be valid by mistake in encoder and decoder
/// alike, so it costs bits at most.
struct CellRef {
  uint32_t slot = no_slot;
  uint32_t ordinal = 0;
};

/// A face of a cell in memory.
struct FaceRef {
  uint32_t cell = no_slot;
  uint32_t face = 0;
};

/// What is in memory while cells stream through: points that will be used again, and the cells around them.
/// There is no table of faces: neighbours have neighbouring slots, so the cells around a point are found
/// faster than a hashed face, and most cells need no search at all (cell_coder.h).
///
/// The cells around a point are a list in blocks of eight: links through the corners of single cells waited
/// for memory at each, which took scattered tetrahedra a quarter more time (docs/history.md,
/// "Where order kept waits at effort 2"). Nothing is ever taken out of a list: a point leaves memory with its
/// whole list, and a cell when its last point does. This makes removal linear in what is removed, and
/// insertion a matter of one write for each corner.
class Hull {
 public:
  /// The rest of a point is one word, as a cell changes all of it at each of its corners. From the lowest bit
  /// on: 32 bits of head, 8 of valence, 1 of alive (with 7 unused), and 16 of open faces, at the top, so that
  /// their carry is lost: the count is modulo 2^16, as docs/format.md, 16.3 says.
  class Point {
   public:
    Point() = default;
    explicit Point(uint64_t with_number) : number(with_number), state_(no_slot | is_alive) {}
    /// Where the newest cell is listed (Hull::use_at()); no_slot: there is none.
    uint32_t head() const { return static_cast<uint32_t>(state_); }
    /// Cells in the list, not above 255.
    unsigned valence() const { return static_cast<uint8_t>(state_ >> 32); }
    bool alive() const { return (state_ & is_alive) != 0; }
    /// Open faces of these cells at the point.
    unsigned open() const { return static_cast<uint16_t>(state_ >> 48); }
    /// Another cell in the list, with the open faces (`entry`) that it adds.
    [[gnu::always_inline]] void enter(uint32_t new_head, uint64_t entry) {
      // The valence stays at 255 instead of carrying into the flag above it.
      const uint64_t counted = valence() == 0xff ? 0 : one_cell;
      state_ = ((state_ & ~uint64_t{no_slot}) | new_head) + entry + counted;
    }
    void close_one() { state_ -= one_face; }
    void end() { state_ = (state_ & ~is_alive) | no_slot; }

    uint64_t number = 0;

   private:
    friend class Hull;
    static constexpr uint64_t one_cell = uint64_t{1} << 32, is_alive = uint64_t{1} << 40,
                              one_face = uint64_t{1} << 48;
    uint64_t state_ = no_slot;
  };
  /// What the open faces that a cell adds at a corner add to the word of a point. `opened` may be negative,
  /// where more faces are glued than are new: the sum then borrows within the top 16 bits only, because it is
  /// a multiple of one_face.
  static uint64_t entry(int opened) {
    return static_cast<uint64_t>(static_cast<int64_t>(opened)) * Point::one_face;
  }
  /// One line of a cache: the cells around it change whenever a point comes or leaves.
  struct alignas(64) Cell {
    std::array<uint32_t, most_corners> corner;  ///< point slots; no_slot where the point has left
    uint32_t successor = no_slot;               ///< slot of the cell coded after it
    uint32_t ordinal = 0;
    uint32_t pattern = 0;
    uint32_t signature = 0;
    uint8_t open = 0;  ///< a bit for each face that no second cell has met
    uint8_t live = 0;  ///< corners whose point is alive
    uint8_t kind = 0;
    uint8_t mark = 0;  ///< for those who collect cells, to take each once
  };

  /// Whether the cell is still the one that was meant, and in memory.
  bool valid(const CellRef& ref) const {
    return ref.slot != no_slot && cells_[ref.slot].ordinal == ref.ordinal && cells_[ref.slot].live != 0;
  }
  const Cell& cell(uint32_t slot) const { return cells_[slot]; }
  Cell& cell(uint32_t slot) { return cells_[slot]; }
  const Point& point(uint32_t slot) const { return points_[slot]; }
  static const CellShape& shape_of(const Cell& cell) { return cell_shapes[cell.kind]; }

  /// A point comes into memory, with no cell around it. Slots are given in the same order by encoder and
  /// decoder, which contexts and values by slot rely on.
  [[gnu::always_inline]] uint32_t add_point(uint64_t number) {
    const uint32_t slot = point_slots_.take();
    if (slot >= points_.size()) [[unlikely]]
      grow_points();
    points_[slot] = Point(number);
    return slot;
  }

  /// Enters a cell into the lists of its corners, in the order of the corners; a point that is several
  /// corners is entered several times. `glued` has a bit for each face that met another, which the caller
  /// closes there; what both take from the open faces of their points is counted here: an own open face adds
  /// one, a glued face takes away the one that its partner had added. Neither `pattern` nor `signature` is
  /// set.
  uint32_t add_cell(unsigned kind, const uint32_t* corners, unsigned glued, uint32_t ordinal) {
    const uint32_t slot = new_cell_slot();
    const CellShape& shape = cell_shapes[kind];
    Cell& cell = cells_[slot];
    for (unsigned i = 0; i < shape.corners; ++i) {
      cell.corner[i] = corners[i];
      const unsigned at = shape.faces_at[i];
      list(corners[i], slot * most_corners + i,
           entry(static_cast<int>(bits_in(at)) - 2 * static_cast<int>(bits_in(at & glued))));
    }
    for (unsigned i = shape.corners; i < most_corners; ++i) cell.corner[i] = no_slot;
    cell.successor = no_slot;
    cell.ordinal = ordinal;
    cell.open = static_cast<uint8_t>(((1u << shape.faces) - 1) & ~glued);
    cell.live = shape.corners;
    cell.kind = static_cast<uint8_t>(kind);
    return slot;
  }

  /// add_cell() of a hexahedron; `entered`: entry() of each corner.
  [[gnu::always_inline]] uint32_t add_hexahedron(const std::array<uint32_t, most_corners>& corners,
                                                 const std::array<uint64_t, most_corners>& entered,
                                                 unsigned glued, uint32_t ordinal) {
    const uint32_t slot = new_cell_slot();
    Cell& cell = cells_[slot];
    const uint32_t from = slot * most_corners;
    const auto enter = [&](unsigned i) { list(corners[i], from + i, entered[i]); };
    // Written out: compilers make a loop of it, and count.
    enter(0), enter(1), enter(2), enter(3), enter(4), enter(5), enter(6), enter(7);
    cell.successor = no_slot;
    cell.ordinal = ordinal;
    cell.open = static_cast<uint8_t>(0x3f & ~glued);
    cell.live = most_corners;
    cell.kind = hexahedron_kind;
    return slot;
  }

  /// The point is not used again: its faces close, and its cells leave when they have no other point. Closing
  /// is not only tidy: its slot will be another point's, and a face left open would seem to be at that one.
  /// The slot itself is free only after free_points(), so that slots name points within a block of cells.
  /// The walk is not limited to most_around, as all references must go; it is paid for by the entering of
  /// these cells.
  void remove_point(uint32_t slot) {
    Point& point = points_[slot];
    Cell* const cells = cells_.data();
    const uint8_t* const faces_at = faces_at_corner.data();
    for (uint32_t at = point.head(); at != no_slot; at = earlier(at)) {
      const uint32_t here = use_at(at);
      const size_t corner = here % most_corners;
      Cell& cell = cells[here / most_corners];
      cell.corner[corner] = no_slot;
      const unsigned closing = cell.open & faces_at[cell.kind * size_t{most_corners} + corner];
      if (closing != 0) [[unlikely]]
        close(cell, closing);
      if (--cell.live == 0) [[unlikely]]
        cell_slots_.give_back(here / most_corners);
    }
    free_blocks(point.head());
    point.end();
    removed_.push_back(slot);
  }
  /// Closes faces of a cell, a bit for each, that no other can meet any more. Corners whose point has left
  /// are skipped.
  [[gnu::noinline]] void close(Cell& cell, unsigned faces) {
    cell.open = static_cast<uint8_t>(cell.open & ~faces);
    for (unsigned left = faces; left != 0; left &= left - 1) {
      const CellFace& face = shape_of(cell).face[static_cast<unsigned>(__builtin_ctz(left))];
      for (unsigned i = 0; i < face.size; ++i) {
        const uint32_t slot = cell.corner[face.corner[i]];
        if (slot != no_slot) points_[slot].close_one();
      }
    }
  }
  /// Between blocks of cells: in the order in which the points ended, which the order of later slots depends
  /// on.
  void free_points() {
    for (const uint32_t slot : removed_) point_slots_.give_back(slot);
    removed_.clear();
  }

  /// Calls visit(cell slot, corner) for the cells around a point, the newest first, until it returns true. It
  /// visits no more than `most_around` of them: a million cells at one point must not take a million times a
  /// million steps.
  template <class Visit>
  bool around(uint32_t slot, Visit visit) const {
    unsigned left = most_around;
    for (uint32_t at = points_[slot].head(); at != no_slot && left != 0; at = earlier(at), --left) {
      const uint32_t use = use_at(at);
      if (visit(use / most_corners, use % most_corners)) return true;
    }
    return false;
  }

  /// The newest open face of `size` corners that has all `count` points of `known`, of which the first is
  /// alive; no_slot if none is among the first `most_around` cells there. It compares sets of points, not
  /// cycles: the caller decides what else must agree. A face that repeats a point can match points that it
  /// has once.
  FaceRef find_face(unsigned size, const uint32_t* known, unsigned count) const {
    FaceRef found;
    around(known[0], [&](uint32_t slot, uint32_t corner) {
      const Cell& cell = cells_[slot];
      for (unsigned faces = cell.open & shape_of(cell).faces_at[corner]; faces != 0; faces &= faces - 1) {
        const auto f = static_cast<uint32_t>(__builtin_ctz(faces));
        const CellFace& face = shape_of(cell).face[f];
        if (face.size != size || !has_all(cell, face, known + 1, count - 1)) continue;
        found = {slot, f};
        return true;
      }
      return false;
    });
    return found;
  }

  /// A slot for a cell whose faces are elsewhere (FaceStore): it is at no point, has no open faces, and
  /// `live` is 0, so that valid() is false for it. FaceStore gives it back with the last face.
  uint32_t take_cell() {
    const uint32_t slot = new_cell_slot();
    cells_[slot] = {};
    return slot;
  }
  void give_back_cell(uint32_t slot) { cell_slots_.give_back(slot); }

  /// Calls visit(slot) for the points in memory.
  template <class Visit>
  void each_point(Visit visit) const {
    for (uint32_t slot = 0; slot < points_.size(); ++slot) {
      if (points_[slot].alive()) visit(slot);
    }
  }

  /// How many are in memory: what a file's end tells as the largest number in use.
  uint32_t live_points() const { return point_slots_.taken(); }
  uint32_t live_cells() const { return cell_slots_.taken(); }
  /// What it takes while so many points and cells more come in, in bytes.
  uint64_t bytes(uint64_t points, uint64_t cells) const {
    points += point_capacity();
    return bytes_to_hold(points_, points) + bytes_to_hold(first_, points * block_size) +
           bytes_to_hold(cells_, cell_capacity() + cells) + bytes_held(more_) + bytes_held(before_);
  }
  /// All slots are below: how large tables by slot have to be.
  uint32_t point_capacity() const { return point_slots_.capacity(); }
  uint32_t cell_capacity() const { return cell_slots_.capacity(); }

 private:
  [[gnu::always_inline]] uint32_t new_cell_slot() {
    const uint32_t slot = cell_slots_.take();
    if (slot >= cells_.size()) [[unlikely]]
      cells_.resize(cell_slots_.capacity());
    return slot;
  }
  [[gnu::noinline]] void grow_points() {
    points_.resize(point_slots_.capacity());
    first_.resize(points_.size() * block_size);
  }
  // Lists have a cell as its slot * 8 + corner. The first eight of a point are at its own slot * 8, and more
  // in blocks of eight, `in_more` and up, which are rare in lattices.
  static constexpr uint32_t block_size = 8, in_more = uint32_t{1} << 31;
  uint32_t use_at(uint32_t at) const { return at < in_more ? first_[at] : more_[at - in_more]; }
  uint32_t earlier(uint32_t at) const {
    if (at % block_size != 0) return at - 1;
    return at < in_more ? no_slot : before_[(at - in_more) / block_size];
  }
  [[gnu::always_inline]] void list(uint32_t slot, uint32_t use, uint64_t entry) {
    Point& point = points_[slot];
    // no_slot stands at the last place of a block, too.
    uint32_t at = point.head() + 1;
    if (at % block_size == 0) [[unlikely]]
      at = at == 0 ? slot * block_size : more_behind(point.head());
    (at < in_more ? first_[at] : more_[at - in_more]) = use;
    point.enter(at, entry);
  }
  [[gnu::noinline]] uint32_t more_behind(uint32_t head) {
    const uint32_t block = block_slots_.take();
    if (block >= before_.size()) {
      before_.resize(block_slots_.capacity());
      more_.resize(before_.size() * block_size);
    }
    before_[block] = head;
    return in_more + block * block_size;
  }
  void free_blocks(uint32_t at) {
    for (; at != no_slot && at >= in_more; at = before_[(at - in_more) / block_size])
      block_slots_.give_back((at - in_more) / block_size);
  }
  // Every point is sought among at most four corners; no sorting would pay.
  static bool has_all(const Cell& cell, const CellFace& face, const uint32_t* points, unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
      bool has = false;
      for (unsigned j = 0; j < face.size; ++j) has = has || cell.corner[face.corner[j]] == points[i];
      if (!has) return false;
    }
    return true;
  }

  std::vector<Point> points_;
  std::vector<Cell> cells_;
  std::vector<uint32_t> first_;   ///< by point slot * 8
  std::vector<uint32_t> more_;    ///< by block * 8
  std::vector<uint32_t> before_;  ///< by block: where the list goes on
  Slots point_slots_;
  Slots cell_slots_;
  Slots block_slots_;
  std::vector<uint32_t> removed_;
};

}  // namespace maille
