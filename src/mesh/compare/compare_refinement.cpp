#include "mesh/compare/compare_refinement.h"

#include <algorithm>
#include <numeric>

#include "mesh/cell_turns.h"

namespace maille {

namespace {

// Beyond these the answer is "undecided": nested choices cost stack, all of them time (some ten seconds at
// most). Meshes get there only when built for it, like the graphs that defeat graph-isomorphism programs.
constexpr unsigned max_depth = 2000;
constexpr uint64_t max_effort = 200'000'000;

/// Polygons of any size: the smallest rotation by two candidates that overtake each other, in linear time
/// (the smallest representation of a cyclic string: each step moves i, j or k on, and all end at n). When
/// both survive, rotations by their distance leave the tokens the same.
void turn_polygon(CanonicalCell& cell) {
  const std::vector<uint64_t>& t = cell.tokens;
  const size_t n = t.size();
  size_t i = 0, j = 1, k = 0;
  while (i < n && j < n && k < n) {
    const uint64_t x = t[i + k < n ? i + k : i + k - n];
    const uint64_t y = t[j + k < n ? j + k : j + k - n];
    if (x == y) {
      ++k;
      continue;
    }
    (x > y ? i : j) += k + 1;
    if (i == j) ++j;
    k = 0;
  }
  const size_t period = k == n ? (i > j ? i - j : j - i) : n;
  for (size_t at = 0; at < n; ++at) {
    cell.corner[at] = (std::min(i, j) + at) % n;
    cell.place[cell.corner[at]] = at % period;
  }
}

/// Tries all turns, of which a hexahedron has 24 and a tetrahedron 12; `place` gets the lowest place of each
/// corner over all turns that come first, so that corners a turn exchanges look alike.
void turn_solid(CanonicalCell& cell, std::span<const CellTurn> turns) {
  const auto compare_to = [&](const CellTurn& turn) {
    size_t at = 0;
    while (at < cell.tokens.size() && cell.tokens[turn.corner[at]] == cell.tokens[cell.corner[at]]) ++at;
    if (at == cell.tokens.size()) return 0;
    return cell.tokens[turn.corner[at]] < cell.tokens[cell.corner[at]] ? -1 : 1;
  };
  for (const CellTurn& turn : turns) {
    const int order = compare_to(turn);
    if (order > 0) continue;
    for (size_t at = 0; at < cell.tokens.size(); ++at) {
      size_t& place = cell.place[turn.corner[at]];
      place = order < 0 ? at : std::min(place, at);
      if (order < 0) cell.corner[at] = turn.corner[at];
    }
  }
}

}  // namespace

void canonicalise(const Elements& elements, const Partition& partition, unsigned side, uint64_t cell,
                  CanonicalCell& out) {
  const Elements::Cell& nodes = elements.cells()[cell];
  const uint64_t first = elements.first_corner(nodes);
  out.tokens.resize(nodes.degree);
  for (size_t i = 0; i < nodes.degree; ++i) {
    // A point is known by its class, not by its number: numbers differ between the meshes.
    out.tokens[i] = hash_mix(elements.corner_hash(first + i), partition.class_of(side, nodes.nodes[i]));
  }
  out.corner.resize(nodes.degree);
  std::iota(out.corner.begin(), out.corner.end(), size_t{0});
  out.place = out.corner;
  if (is_face(elements.type_of(nodes))) {
    turn_polygon(out);
  } else {
    turn_solid(out, turns_of(elements.type_of(nodes)));
  }
  uint64_t hash = hash_mix(elements.cell_hash(cell), nodes.degree);
  for (const size_t corner : out.corner) hash = hash_mix(hash, out.tokens[corner]);
  out.hash = scrambled(hash);
}

Refinement::Refinement(const Elements& a, const Elements& b, Partition& partition)
    : elements_{&a, &b}, partition_(partition) {
  for (unsigned side = 0; side < 2; ++side) find_cells(side);
}

void Refinement::find_cells(unsigned side) {
  const auto& cells = elements_[side]->cells();
  const uint64_t points = elements_[side]->mesh().point_count();
  marked_[side].assign(points, false);
  marked_cells_[side].assign(cells.size(), false);
  sums_[side].assign(points, 0);
  const auto for_each_pair = [&](auto work) {
    for (uint64_t c = 0; c < cells.size(); ++c) {
      for (const uint32_t point : cells[c].points()) {
        if (!partition_.is_pair(side, point)) work(point, c);
      }
    }
  };
  // A point twice in a cell takes two places; the second repeats the cell's number and is skipped by whoever
  // marks cells.
  auto& first = first_cell_[side];
  first.assign(points + 1, 0);
  for_each_pair([&](uint32_t point, uint64_t) { ++first[point + 1]; });
  for (uint64_t i = 0; i < points; ++i) first[i + 1] += first[i];
  incident_[side].resize(first[points]);
  std::vector<uint64_t> next(first.begin(), first.end() - 1);
  for_each_pair([&](uint32_t point, uint64_t cell) { incident_[side][next[point]++] = cell; });
}

std::span<const uint64_t> Refinement::cells_of(unsigned side, uint32_t point) const {
  const auto& first = first_cell_[side];
  return std::span(incident_[side]).subspan(first[point], first[point + 1] - first[point]);
}

// Only cells with a moved point count. What a point's other cells tell was the same for all of its class
// before and is so still, and a cell with a point in a new class is unlike any cell without.
//
// Returns the sum of the hashes of all cells looked at. It shows what the points cannot: a cell whose points
// are all paired by now is asked for by none of them.
uint64_t Refinement::collect_entries(unsigned side, const Points& moved,
                                     std::vector<Partition::Entry>& entries) {
  uint64_t sum = 0;
  std::vector<uint64_t> cells;
  Points touched;
  for (const uint32_t point : moved) {
    for (const uint64_t cell : cells_of(side, point)) {
      if (marked_cells_[side][cell]) continue;
      marked_cells_[side][cell] = true;
      cells.push_back(cell);
    }
  }
  for (const uint64_t cell : cells) {
    marked_cells_[side][cell] = false;
    canonicalise(*elements_[side], partition_, side, cell, canonical_);
    sum += canonical_.hash;
    const auto points = elements_[side]->cells()[cell].points();
    for (size_t i = 0; i < points.size(); ++i) {
      if (partition_.is_pair(side, points[i])) continue;
      if (!marked_[side][points[i]]) touched.push_back(points[i]);
      marked_[side][points[i]] = true;
      // Summed, because the cells around a point come in any order.
      sums_[side][points[i]] += scrambled(hash_mix(canonical_.hash, canonical_.place[i]));
    }
  }
  for (const uint32_t point : touched) {
    entries.push_back({partition_.class_of(side, point), point, sums_[side][point]});
    marked_[side][point] = false;
    sums_[side][point] = 0;
  }
  return sum;
}

/// Splits classes in rounds until none can be split. A round looks only at the cells of points that moved,
/// and a point moves into a class of at most half the size, so there is an end.
bool Refinement::refine(Points (&moved)[2]) {
  while (!moved[0].empty() || !moved[1].empty()) {
    std::vector<Partition::Entry> entries[2];
    uint64_t sums[2];
    for (unsigned side = 0; side < 2; ++side) {
      sums[side] = collect_entries(side, moved[side], entries[side]);
      moved[side].clear();
    }
    Partition::Witness witness;
    if (!partition_.split(entries, moved, &witness)) {
      witness_ = witness;
      return false;
    }
    // All points have partners, and yet the cells around them differ.
    if (sums[0] != sums[1]) return false;
  }
  return true;
}

bool Refinement::refine_all() {
  Points all[2];
  for (unsigned side = 0; side < 2; ++side) {
    for (uint32_t c = 0; c < partition_.class_count(); ++c) {
      if (partition_.at(c).size == 1) continue;
      const auto points = partition_.points(side, c);
      all[side].insert(all[side].end(), points.begin(), points.end());
    }
  }
  return refine(all);
}

bool Refinement::isolate(const Points (&points)[2]) {
  std::vector<Partition::Entry> entries[2];
  for (unsigned side = 0; side < 2; ++side) {
    for (const uint32_t point : points[side])
      entries[side].push_back({partition_.class_of(side, point), point, 0});
  }
  Points moved[2];
  return partition_.split(entries, moved, nullptr);
}

// Connected through points that are not paired: the pairs are settled, so that what hangs on them separately
// can be matched separately.
std::vector<Refinement::Component> Refinement::components(unsigned side, const Points& points) {
  std::vector<Component> found;
  std::vector<uint64_t> cells;
  for (const uint32_t seed : points) {
    if (marked_[side][seed] || partition_.is_pair(side, seed)) continue;
    Points members = {seed};
    marked_[side][seed] = true;
    for (size_t i = 0; i < members.size(); ++i) {
      for (const uint64_t cell : cells_of(side, members[i])) {
        if (marked_cells_[side][cell]) continue;
        marked_cells_[side][cell] = true;
        cells.push_back(cell);
        for (const uint32_t point : elements_[side]->cells()[cell].points()) {
          if (marked_[side][point] || partition_.is_pair(side, point)) continue;
          marked_[side][point] = true;
          members.push_back(point);
        }
      }
    }
    uint64_t key = scrambled(members.size());
    for (const uint32_t point : members) key += scrambled(partition_.class_of(side, point) + 1);
    found.push_back({key, std::move(members)});
  }
  for (const Component& component : found) {
    for (const uint32_t point : component.points) marked_[side][point] = false;
  }
  for (const uint64_t cell : cells) marked_cells_[side][cell] = false;
  // Components are sorted by key, and equal ones by their first points, so the search is the same on every
  // machine.
  std::stable_sort(found.begin(), found.end(),
                   [](const Component& x, const Component& y) { return x.key < y.key; });
  return found;
}

Refinement::Outcome Refinement::search() {
  Points all[2];
  for (unsigned side = 0; side < 2; ++side) {
    for (uint32_t point = 0; point < marked_[side].size(); ++point) {
      if (!partition_.is_pair(side, point)) all[side].push_back(point);
    }
  }
  return match(all);
}

// Being alike is an equivalence: the first component of B that matches one of A is as good as any other, and
// is never taken back here.
Refinement::Outcome Refinement::match(const Points (&points)[2]) {
  std::vector<Component> found[2] = {components(0, points[0]), components(1, points[1])};
  if (found[0].size() != found[1].size()) return Outcome::impossible;
  std::vector<bool> taken(found[1].size(), false);
  size_t first_free = 0;
  for (Component& in_a : found[0]) {
    // Both lists are sorted by key, and equal components are taken from the front on, so that many alike
    // components take linear time.
    while (first_free < taken.size() && taken[first_free]) ++first_free;
    Outcome outcome = Outcome::impossible;
    for (size_t j = first_free; j < taken.size() && found[1][j].key <= in_a.key; ++j) {
      if (taken[j] || found[1][j].key != in_a.key) continue;
      has_chosen_ = true;
      const Points pair[2] = {in_a.points, found[1][j].points};
      outcome = match_component(pair);
      if (outcome == Outcome::impossible) continue;
      taken[j] = true;
      break;
    }
    if (outcome != Outcome::paired) return outcome;
  }
  return Outcome::paired;
}

Refinement::Outcome Refinement::match_component(const Points (&points)[2]) {
  // Counted where points are looked at, so that the bound is one of time, and the same on every machine.
  effort_ += points[0].size();
  if (++depth_ > max_depth || effort_ > max_effort) return Outcome::given_up;
  const uint32_t mark = partition_.class_count();
  Outcome outcome = Outcome::impossible;
  if (isolate(points)) {
    // The smallest class gives the fewest choices.
    uint32_t chosen = partition_.class_of(0, points[0][0]);
    for (const uint32_t point : points[0]) {
      const uint32_t c = partition_.class_of(0, point);
      const uint32_t size = partition_.at(c).size, best = partition_.at(chosen).size;
      if (size > 1 && (best == 1 || size < best)) chosen = c;
    }
    if (partition_.at(chosen).size == 1) outcome = Outcome::paired;
    const auto in_b = partition_.points(1, chosen);
    const Points candidates(in_b.begin(), in_b.end());
    const uint32_t fixed = partition_.points(0, chosen)[0];
    for (size_t i = 0; i < candidates.size() && outcome == Outcome::impossible; ++i) {
      const uint32_t before = partition_.class_count();
      const Points pair[2] = {{fixed}, {candidates[i]}};
      Points moved[2] = {{fixed}, {candidates[i]}};
      // A try costs something even where nothing has to be refined.
      effort_ += 10;
      outcome = isolate(pair) && refine(moved) ? match(points) : Outcome::impossible;
      if (outcome == Outcome::impossible) partition_.undo(before);
    }
  }
  if (outcome == Outcome::impossible) partition_.undo(mark);
  --depth_;
  return outcome;
}

}  // namespace maille
