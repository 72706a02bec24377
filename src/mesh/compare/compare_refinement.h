#pragma once

#include "mesh/compare/compare_partition.h"

#include <optional>
#include <vector>

namespace maille {

/// The corners of a cell as hashes, turned as comes first among all ways to turn it: the same however the
/// cell was turned.
struct CanonicalCell {
  std::vector<uint64_t> tokens;  ///< as in the cell: class of the point, and corner values
  std::vector<size_t> corner;    ///< in the turn that comes first
  std::vector<size_t> place;     ///< by corner: that in the turn, the lowest where several come first
  uint64_t hash = 0;             ///< of everything about the cell
};

/// Fills `out` for one cell; its memory is used again. Points are known by their classes.
void canonicalise(const Elements& elements, const Partition& partition, unsigned side, uint64_t cell,
                  CanonicalCell& out);

/// Tells points apart by the cells round them, until nothing new is learnt (Weisfeiler and Leman 1968), and
/// looks for a renaming by trying pairs where points still look alike. Works on points that are not yet
/// paired only; cost grows with their cells. This is graph isomorphism: refinement settles nearly all meshes,
/// what is left are symmetric ones without values, and search() gives up where choices nest too deep.
class Refinement {
 public:
  enum class Outcome { paired, impossible, given_up };

  Refinement(const Elements& a, const Elements& b, Partition& partition);
  /// What the cells alone tell: every renaming keeps to it. False: there is no renaming; see witness().
  bool refine_all();
  /// Pairs all points that are left, if a renaming exists; the partition then holds it.
  Outcome search();
  /// Whether search() had to choose: another choice might have done as well.
  bool has_chosen() const { return has_chosen_; }
  /// A point without a partner, when refine_all() found one; else two cells differ whose points all have one.
  const std::optional<Partition::Witness>& witness() const { return witness_; }

 private:
  using Points = std::vector<uint32_t>;
  struct Component {
    uint64_t key;  ///< of its classes: components of different keys do not match
    Points points;
  };

  std::span<const uint64_t> cells_of(unsigned side, uint32_t point) const;
  void find_cells(unsigned side);
  bool refine(Points (&moved)[2]);
  uint64_t collect_entries(unsigned side, const Points& moved, std::vector<Partition::Entry>& entries);
  bool isolate(const Points (&points)[2]);
  std::vector<Component> components(unsigned side, const Points& points);
  Outcome match(const Points (&points)[2]);
  Outcome match_component(const Points (&points)[2]);

  const Elements* elements_[2];
  Partition& partition_;
  std::vector<uint64_t> first_cell_[2];  ///< per point, into incident_
  std::vector<uint64_t>
      incident_[2];  ///< cells of points that are not paired at the start, each cell once per point
  std::vector<uint64_t> sums_[2];      ///< scratch of collect_entries
  std::vector<bool> marked_[2];        ///< scratch: points
  std::vector<bool> marked_cells_[2];  ///< scratch: cells
  CanonicalCell canonical_;
  std::optional<Partition::Witness> witness_;
  bool has_chosen_ = false;
  unsigned depth_ = 0;
  uint64_t effort_ = 0;  ///< points looked at by choices
};

}  // namespace maille
