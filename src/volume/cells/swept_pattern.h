#pragma once

#include <array>
#include <cstdint>

#include "base/lanes.h"
#include "volume/cells/patterns.h"

namespace maille {

/// Slots of the corners of a hexahedron: one by one, and four at a time, which is how they are copied. A new
/// corner is in `slot` only.
struct HexahedronSlots {
  std::array<uint32_t, most_corners> slot;
  Lanes low, high;
};

/// A pattern of hexahedra as CellCoder::sweep() applies it: by corner, so that no loop depends on how many
/// there are. Each takes a few hundred bytes, which few patterns deserve; sweep() keeps those that it met
/// last. All of it follows from the plan: it may be made anew at any time.
struct SweptPattern {
  struct From {
    uint8_t source = 0, corner = 0;
  };
  uint32_t id = 0;  ///< 0: none
  uint32_t signature = 0;
  uint8_t fresh = 0, known = 0, glued = 0, final = 0, glues = 0;
  uint8_t first_fresh = 0;
  bool several = false;                   ///< new corners
  uint8_t expects = 0;                    ///< a bit for each new corner with an expected number
  std::array<From, most_corners> from{};  ///< of a new corner that of one which is known
  std::array<PatternPlan::Glue, most_faces> glue{};
  std::array<CellShape::Parallelogram, most_corners> expected{};  ///< by new corner: the first that is known
  uint64_t ends = 0;                              ///< by corner a byte: 0x80 if it is used for the last time
  std::array<uint64_t, most_corners> is_known{};  ///< all bits, or none
  std::array<uint64_t, most_corners> entered{};   ///< what Hull::add_hexahedron() adds to the points

  SweptPattern() = default;
  /// If plan.sweeps.
  SweptPattern(const PatternPlan& plan, uint32_t id, uint32_t signature);
};

}  // namespace maille
