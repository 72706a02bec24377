#pragma once

#include <array>
#include <cstdint>

#include "volume/cells/hull.h"

namespace maille {

/// A cell while it is coded: which of its corners are known, and to which faces it is glued. Both directions
/// fill it step by step with the same operations, and later steps look only at what is here, never at the
/// cell that is wanted. A corner may be known and fresh at once: create_corners() gives slots to new ones.
/// Entries of `corner` and `glue` without their bit are left from cells before.
struct Assembly {
  unsigned kind = 0;
  unsigned known = 0;  ///< a bit for each corner that has a slot
  unsigned fresh = 0;  ///< a bit for each corner that is a new point
  unsigned glued = 0;  ///< a bit for each face with an entry in `glue`
  std::array<uint32_t, most_corners> corner{};
  std::array<FaceRef, most_faces> glue{};

  const CellShape& shape() const { return cell_shapes[kind]; }
  bool has(unsigned i) const { return (known >> i & 1) != 0; }
  bool is_fresh(unsigned i) const { return (fresh >> i & 1) != 0; }
  bool is_glued(unsigned face) const { return (glued >> face & 1) != 0; }
  void set_corner(unsigned i, uint32_t slot) {
    corner[i] = slot;
    known |= 1u << i;
  }
  void set_glue(unsigned face, FaceRef other) {
    glue[face] = other;
    glued |= 1u << face;
  }
  /// Slots of those corners of a face that are known; their number.
  unsigned known_of(const CellFace& face, std::array<uint32_t, 4>& slots) const {
    unsigned count = 0;
    for (unsigned i = 0; i < face.size; ++i) {
      if (has(face.corner[i])) slots[count++] = corner[face.corner[i]];
    }
    return count;
  }
};

}  // namespace maille
