#include "mesh/compare/compare_renaming.h"

#include "mesh/compare/compare_refinement.h"

#include <algorithm>

namespace maille {

namespace {

Decision different(std::string difference) {
  return {Verdict::different, std::move(difference)};
}

std::string describe_point(const Elements& elements, uint64_t point) {
  return "point " + std::to_string(point) + " " + describe_tuple(elements.mesh().points, point) +
         elements.describe_values(Domain::point, point);
}

/// Elements of one list of sorted hashes that are more often there than in the other.
struct Surplus {
  uint64_t count = 0;
  uint64_t first = 0;            ///< smallest number of an element in surplus
  uint64_t here = 0, there = 0;  ///< how often an element like it occurs
};

/// Both lists are sorted by hash, so that one pass over both finds it. The element with the lowest number is
/// named, not the one with the lowest hash: the message is the same for any seed.
Surplus surplus(const std::vector<Keyed>& here, const std::vector<Keyed>& there) {
  Surplus result;
  size_t j = 0;
  for (size_t i = 0; i < here.size();) {
    size_t end = i;
    while (end < here.size() && here[end].hash == here[i].hash) ++end;
    while (j < there.size() && there[j].hash < here[i].hash) ++j;
    const size_t first_there = j;
    while (j < there.size() && there[j].hash == here[i].hash) ++j;
    const uint64_t count = end - i, other = j - first_there;
    if (count > other) {
      if (result.count == 0 || here[i].index < result.first)
        result = {result.count, here[i].index, count, other};
      result.count += count - other;
    }
    i = end;
  }
  return result;
}

/// One element that is in A too often, or else one that is in B too often.
template <class Describe>
std::string describe_surplus(const std::vector<Keyed>& in_a, const std::vector<Keyed>& in_b, const char* what,
                             Describe describe) {
  const Surplus a = surplus(in_a, in_b), b = surplus(in_b, in_a);
  const bool of_a = a.count > 0;
  const Surplus& s = of_a ? a : b;
  std::string text =
      std::to_string(s.count) + " " + what + (s.count == 1 ? "" : "s") + " of " + (of_a ? "A" : "B");
  text += s.count == 1 ? " has" : " have";
  text += std::string(" no partner in ") + (of_a ? "B" : "A");
  if (of_a && b.count > 0) text += " and " + std::to_string(b.count) + " of B none in A";
  text += s.count == 1 ? ": " : "; first: ";
  text += describe(of_a ? 0u : 1u, s.first);
  if (s.here > 1 || s.there > 0) {
    text += ", " + std::to_string(of_a ? s.here : s.there) + " times in A, " +
            std::to_string(of_a ? s.there : s.here) + " times in B";
  }
  return text;
}

std::vector<Keyed> sorted_points(const Elements& elements) {
  std::vector<Keyed> keyed(elements.mesh().point_count());
  for (uint64_t i = 0; i < keyed.size(); ++i) keyed[i] = {elements.point_hash(i), i};
  std::sort(keyed.begin(), keyed.end());
  return keyed;
}

/// Cells by a hash of everything that a renaming must keep, given what is known of the points. Equal
/// multisets are needed for equal meshes; they are enough only after check().
std::vector<Keyed> sorted_cells(const Elements& elements, const Partition& partition, unsigned side) {
  std::vector<Keyed> keyed(elements.cells().size());
  CanonicalCell canonical;
  for (uint64_t i = 0; i < keyed.size(); ++i) {
    canonicalise(elements, partition, side, i, canonical);
    keyed[i] = {canonical.hash, i};
  }
  std::sort(keyed.begin(), keyed.end());
  return keyed;
}

/// As multisets: both lists are sorted.
bool same_hashes(const std::vector<Keyed>& a, const std::vector<Keyed>& b) {
  const auto same = [](const Keyed& x, const Keyed& y) { return x.hash == y.hash; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

/// A renaming, as pairs, put to the test value by value.
class Check {
 public:
  Check(const Elements& a, const Elements& b, const Partition& partition)
      : a_(a), b_(b), partition_(partition) {}

  bool points_equal() const {
    for (uint32_t i = 0; i < a_.mesh().point_count(); ++i) {
      if (!equal_values(a_, Domain::point, i, b_, partner(i))) return false;
    }
    return true;
  }

  /// Cells in the order of A, so that at least one side is read front to back.
  bool cells_equal(const std::vector<Keyed>& in_a, const std::vector<Keyed>& in_b) {
    // Both lists are sorted by the same hashes, so the i-th of each are partners, unless hashes collided.
    std::vector<uint64_t> partners(in_a.size());
    for (size_t i = 0; i < in_a.size(); ++i) partners[in_a[i].index] = in_b[i].index;
    for (uint64_t i = 0; i < partners.size(); ++i) {
      if (!cell_equal(i, partners[i])) return false;
    }
    return true;
  }

 private:
  uint32_t partner(uint32_t point) const { return partition_.points(1, partition_.class_of(0, point))[0]; }

  bool cell_equal(uint64_t i, uint64_t j) {
    const Elements::Cell& x = a_.cells()[i];
    const Elements::Cell& y = b_.cells()[j];
    if (x.degree != y.degree || !equal_kinds(a_, x, b_, y) || !equal_values(a_, Domain::cell, i, b_, j))
      return false;
    canonicalise(a_, partition_, 0, i, canonical_);
    const std::vector<size_t> corner = canonical_.corner;
    canonicalise(b_, partition_, 1, j, canonical_);
    const uint64_t first_x = a_.first_corner(x), first_y = b_.first_corner(y);
    for (size_t k = 0; k < x.degree; ++k) {
      const size_t p = corner[k], q = canonical_.corner[k];
      if (partner(x.nodes[p]) != y.nodes[q]) return false;
      if (!equal_values(a_, Domain::corner, first_x + p, b_, first_y + q)) return false;
    }
    return true;
  }

  const Elements& a_;
  const Elements& b_;
  const Partition& partition_;
  CanonicalCell canonical_;
};

std::string describe_cells(const Elements& a, const Elements& b, const std::vector<Keyed>& in_a,
                           const std::vector<Keyed>& in_b) {
  return describe_surplus(in_a, in_b, "cell", [&](unsigned side, uint64_t cell) {
    return (side == 0 ? a : b).describe_cell(cell);
  });
}

Decision collided() {
  return {Verdict::collided, "the comparison could not be decided (its hashes collided)"};
}

Decision check(const Elements& a, const Elements& b, const Partition& partition, bool chosen) {
  Check check(a, b, partition);
  if (!check.points_equal()) return collided();
  const std::vector<Keyed> in_a = sorted_cells(a, partition, 0), in_b = sorted_cells(b, partition, 1);
  if (!same_hashes(in_a, in_b)) {
    // Forced pairs leave no other renaming; chosen ones got here through a collision only.
    return chosen ? collided() : different(describe_cells(a, b, in_a, in_b));
  }
  return check.cells_equal(in_a, in_b) ? Decision{} : collided();
}

/// Cells whose points are known by their classes. Cells of paired points only are settled by this; the others
/// get here once more.
std::optional<Decision> compare_cells(const Elements& a, const Elements& b, const Partition& partition) {
  const std::vector<Keyed> in_a = sorted_cells(a, partition, 0), in_b = sorted_cells(b, partition, 1);
  if (same_hashes(in_a, in_b)) return std::nullopt;
  return different(describe_cells(a, b, in_a, in_b));
}

std::string describe_witness(const Elements& elements, const Partition::Witness& witness) {
  return std::string(witness.side == 0 ? "A" : "B") + ": " + describe_point(elements, witness.point) +
         " has no partner in " + (witness.side == 0 ? "B" : "A") +
         " with the same values and the same cells round it";
}

}  // namespace

// The work goes from cheap to expensive. Points whose values are unique in both meshes are pairs at once, and
// in most meshes these are all points; then come the cells around the others, and at last a search. check()
// compares all values at the end, so "equal" never rests on a hash.
Decision find_renaming(const Elements& a, const Elements& b) {
  std::optional<Partition> partition;
  {
    const std::vector<Keyed> in_a = sorted_points(a), in_b = sorted_points(b);
    partition = Partition::from_hashes(in_a, in_b);
    if (!partition) {
      return different(describe_surplus(in_a, in_b, "point", [&](unsigned side, uint64_t point) {
        return describe_point(side == 0 ? a : b, point);
      }));
    }
  }
  if (partition->all_pairs()) return check(a, b, *partition, false);
  if (auto decision = compare_cells(a, b, *partition)) return *decision;

  Refinement refinement(a, b, *partition);
  if (!refinement.refine_all()) {
    if (const auto& witness = refinement.witness()) {
      return different(describe_witness(witness->side == 0 ? a : b, *witness));
    }
    return compare_cells(a, b, *partition).value_or(collided());
  }
  switch (refinement.search()) {
    case Refinement::Outcome::paired:
      return check(a, b, *partition, refinement.has_chosen());
    case Refinement::Outcome::impossible:
      return different(
          "the meshes look alike round every point, but no renaming of the points makes them equal (all were "
          "tried)");
    case Refinement::Outcome::given_up:
      break;
  }
  return {Verdict::given_up, "the comparison could not be decided: the meshes are too symmetric"};
}

}  // namespace maille
