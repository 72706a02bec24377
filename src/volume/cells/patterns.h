#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "volume/cells/assembly.h"

namespace maille {

/// Cells that a pattern refers to: the last one, and for each of its faces the cell that was coded right
/// after its neighbour there. In a sweep, whatever joined one cell to its neighbour joins the next one to the
/// next neighbour.
inline constexpr unsigned source_count = 1 + most_faces;
struct Sources {
  std::array<uint32_t, source_count> cell{};  ///< slots; no_slot: there is none, or it has left memory
  unsigned there = 0;                         ///< a bit for each that is in memory
};

/// How a cell is joined to what is in memory, in terms of its sources: a whole cell is "the same again, one
/// step on". Two cells that are joined alike have equal patterns wherever they lie. docs/format.md, 16.5.
struct Pattern {
  // Larger than any source (0 to 6), so that one byte holds either.
  static constexpr uint8_t new_point = 255;
  static constexpr uint8_t by_search = 254;

  uint8_t kind = 0;
  uint8_t final = 0;                           ///< a bit for each corner that is used for the last time
  std::array<uint8_t, most_corners> source{};  ///< by corner: a source, new_point, or by_search
  std::array<uint8_t, most_corners> corner{};  ///< in the source
  std::array<uint8_t, most_faces> glue{};      ///< by face: 0 none, 1 + source, by_search
  std::array<uint8_t, most_faces> other{};     ///< face of the source

  bool operator==(const Pattern&) const = default;
};

/// A pattern as it is applied: only what there is to do, as lists instead of a look at each corner and face.
/// A cell of a regular mesh is made from one of these.
struct PatternPlan {
  struct Corner {
    uint8_t own, source, corner;
  };
  struct Glue {
    uint8_t own, source, face;
  };
  uint8_t kind = 0;
  uint8_t final = 0;
  uint8_t sources = 0;  ///< a bit for each that must be there
  uint8_t corners = 0, glues = 0;
  uint8_t fresh = 0, known = 0, glued = 0;  ///< by sources
  uint8_t searched = 0;                     ///< a bit for each face that is found by search
  std::array<Corner, most_corners> corner{};
  std::array<Glue, most_faces> glue{};
  /// For CellCoder::sweep(): a hexahedron with a known corner, and nothing is searched for.
  bool sweeps = false;

  PatternPlan() = default;
  explicit PatternPlan(const Pattern& pattern);
};

/// The patterns met so far, numbered from 1; 0 stands for none, and has an empty plan that applies nowhere
/// useful. Encoder and decoder number them alike, as each describes the cells of the slow path by itself.
class Patterns {
 public:
  // As ids are kept in the cells of the hull and tell contexts, and a hostile stream must not make a table
  // without end: 65,535 patterns take some megabytes. Later ones are not remembered, which costs bits.
  static constexpr uint32_t most = 65535;

  const PatternPlan& operator[](uint32_t id) const { return plans_[id]; }
  uint32_t signature(uint32_t id) const { return signatures_[id]; }
  /// Returns the number of the pattern, a new one if it was not met before and there is room; else 0.
  /// `signature`: how a cell of this pattern was coded first; all later ones get the same, as if they had
  /// been coded that way.
  uint32_t add(const Pattern& pattern, uint32_t signature);

  /// Puts a cell together from its sources. False when the pattern does not apply here: a source has gone, a
  /// corner has left, a face is closed, or a search finds nothing. `cell` is then left half made.
  [[gnu::always_inline]] static bool apply(const PatternPlan& plan, const Hull& hull, const Sources& sources,
                                           Assembly& cell) {
    if ((plan.sources & ~sources.there) != 0) return false;
    cell.kind = plan.kind;
    cell.known = plan.known;
    cell.fresh = plan.fresh;
    cell.glued = plan.glued;
    bool gone = false;
    for (unsigned k = 0; k < plan.corners; ++k) {
      const PatternPlan::Corner& from = plan.corner[k];
      const uint32_t slot = hull.cell(sources.cell[from.source]).corner[from.corner];
      cell.corner[from.own] = slot;
      gone |= slot == no_slot;
    }
    for (unsigned k = 0; k < plan.glues; ++k) {
      const PatternPlan::Glue& from = plan.glue[k];
      const uint32_t source = sources.cell[from.source];
      cell.glue[from.own] = {source, from.face};
      gone |= (hull.cell(source).open >> from.face & 1) == 0;
    }
    if (gone) return false;
    if (plan.searched != 0) return search(plan, hull, cell);
    return (cell.known | cell.fresh) == (1u << cell.shape().corners) - 1;
  }
  /// Is a face that was found by search one of a source's here? Then another pattern says the same sooner.
  static bool is_nearer(const PatternPlan& plan, const Sources& sources, const Assembly& cell);
  /// Describes a cell whose corners are all known or fresh as a pattern; false if it cannot be said in terms
  /// of sources. The description is applied once to be sure that it gives the cell again: a search could find
  /// another face.
  static bool describe(const Assembly& cell, const Hull& hull, const Sources& sources, Pattern& pattern);

 private:
  static bool search(const PatternPlan& plan, const Hull& hull, Assembly& cell);

  std::vector<Pattern> patterns_ = {{}};
  std::vector<PatternPlan> plans_ = {{}};
  std::vector<uint32_t> signatures_ = {0};
  // Open addressing over ids, at most half full, so that the search for an empty entry ends.
  std::vector<uint32_t> table_ = std::vector<uint32_t>(2 * (most + 1), 0);
};

}  // namespace maille
