// The fastest path of the cell coder: within a row of a structured mesh cell after cell has the same pattern, and
// so have its sources. Nothing has to be chosen then: no candidates, no slow way, no new pattern.
#include "volume/cell_coder.h"

namespace maille {
namespace {

/// Cells are written into room for so many.
constexpr size_t at_once = 64;

void make_room(CodedCells& out, size_t cells, size_t nodes) {
  out.kinds.resize(cells);
  out.begin.resize(cells);
  out.cell_slots.resize(cells);
  out.across.resize(cells);
  out.nodes.resize(nodes);
}

/// Flags of eight nodes, a byte for each, as bits.
unsigned bits_of(const uint8_t* flags) {
  unsigned bits = 0;
  for (unsigned i = 0; i < most_corners; ++i) bits |= (flags[i] != 0 ? 1u : 0u) << i;
  return bits;
}

}  // namespace

template <class Coder>
size_t CellCoder<Coder>::sweep(Coder& topology, Coder& numbers, const uint64_t* points,
                               const uint8_t* last_use, size_t most, CodedCells& out) {
  if (swept_last_ || damaged_ || faces_ || indices_ || !hull_.valid(last_)) return 0;
  const uint32_t id = hull_.cell(last_.slot).pattern;
  const PatternPlan& plan = patterns_[id];
  if (!plan.sweeps) return 0;
  // Without rows the pattern of the last cell is the third candidate, and the only one.
  const unsigned place = plan.rows > 0 ? 0 : 2, agreement = plan.rows > 0 ? 3 : 1;
  RunModel* const flags = &pattern_flags_[(((id & 511) * 3 + place) * 4 + agreement) * 4];
  cell_.kind = plan.kind;
  cell_.fresh = plan.fresh;
  cell_.glued = plan.glued;
  const size_t before = out.size(), nodes_before = out.nodes.size();
  size_t done = 0, room = 0;
  for (; done < most && go_on(plan, id); ++done, points += most_corners, last_use += most_corners) {
    bool hit = false;
    if constexpr (encoding) hit = plan.final == bits_of(last_use) && has_corners(plan, points);
    hit = flags[outcomes_].code(topology, hit);
    outcomes_ = (outcomes_ * 2 + hit) & 3;
    swept_last_ = !hit;
    if (!hit) break;
    create_swept_corners(plan, numbers, points, static_cast<uint32_t>(before + done), out);
    if (damaged_) break;
    if (done == room) {
      room = done + at_once < most ? done + at_once : most;
      make_room(out, before + room, nodes_before + room * most_corners);
    }
    enter_swept(plan, id, before + done, nodes_before + done * most_corners, out);
  }
  make_room(out, before + done, nodes_before + done * most_corners);
  if (done == 0) return 0;
  last_kind_ = plan.kind;
  signature_ = patterns_.signature(id);
  for (size_t i = 0; i < done && i < last_signatures_.size(); ++i)
    last_signatures_ = {signature_, last_signatures_[0], last_signatures_[1]};
  return done;
}

/// Whether the sources of the next cell are there and have the pattern, and it applies: with what find_sources(),
/// the choice of candidates and Patterns::apply() ask for.
template <class Coder>
[[gnu::always_inline]] inline bool CellCoder<Coder>::go_on(const PatternPlan& plan, uint32_t id) {
  std::array<const Hull::Cell*, source_count> source;
  source[0] = &hull_.cell(last_.slot);
  sources_.cell[0] = last_.slot;
  bool good = source[0]->live != 0;
  for (unsigned k = 0; k < plan.rows; ++k) {
    const CellRef& next = successors_[plan.row[k]];
    if (next.slot == no_slot) return false;
    const Hull::Cell& cell = hull_.cell(next.slot);
    good = good && cell.ordinal == next.ordinal && cell.live != 0 && cell.pattern == id;
    source[plan.row[k] + 1u] = &cell;
    sources_.cell[plan.row[k] + 1u] = next.slot;
  }
  if (!good) return false;
  for (unsigned k = 0; k < plan.corners; ++k) {
    const PatternPlan::Corner& from = plan.corner[k];
    const uint32_t slot = source[from.source]->corner[from.corner];
    cell_.corner[from.own] = slot;
    good &= slot != no_slot;
  }
  for (unsigned k = 0; k < plan.glues; ++k) {
    const PatternPlan::Glue& from = plan.glue[k];
    cell_.glue[from.own] = {sources_.cell[from.source], from.face};
    good &= (source[from.source]->open >> from.face & 1) != 0;
  }
  cell_.known = plan.known;
  return good;
}

/// Encoder: fits(), but for the ends.
template <class Coder>
[[gnu::always_inline]] inline bool CellCoder<Coder>::has_corners(const PatternPlan& plan,
                                                                 const uint64_t* points) {
  uint64_t different = 0;
  for (unsigned k = 0; k < plan.corners; ++k) {
    const unsigned own = plan.corner[k].own;
    different |= input_number(cell_.corner[own]) ^ points[own];
  }
  if (different != 0) return false;
  for (unsigned fresh = plan.fresh; fresh != 0; fresh &= fresh - 1) {
    const auto i = static_cast<unsigned>(__builtin_ctz(fresh));
    if (slot_of_input(points[i], i) != no_slot) return false;
    for (unsigned j = 0; j < i; ++j) {
      if (points[j] == points[i]) return false;
    }
  }
  return true;
}

/// As create_corners().
template <class Coder>
[[gnu::always_inline]] inline void CellCoder<Coder>::create_swept_corners(const PatternPlan& plan,
                                                                          Coder& numbers,
                                                                          const uint64_t* points, uint32_t cell,
                                                                          CodedCells& out) {
  const bool several = (plan.fresh & (plan.fresh - 1)) != 0;
  for (unsigned fresh = plan.fresh; fresh != 0; fresh &= fresh - 1) {
    const auto i = static_cast<unsigned>(__builtin_ctz(fresh));
    NewPoint& point = out.points.emplace_back();
    point.cell = cell;
    point.node = static_cast<uint8_t>(i);
    point.fresh = plan.fresh;
    if (several) points_behind(point, i);
    const bool expects = (plan.expects >> i & 1) != 0;
    const CellShape::Parallelogram& p = plan.expected[i];
    const uint64_t expected = expects ? number_of(cell_.corner[p.a]) + number_of(cell_.corner[p.b]) -
                                            number_of(cell_.corner[p.opposite])
                                      : 0;
    point.slot = create_point(numbers, encoding ? points[i] : 0, expects, expected, i + (several ? 8 : 0), i);
    if (damaged_) return;
    point.number = encoding ? points[i] : number_of(point.slot);
    cell_.set_corner(i, point.slot);
  }
}

/// As enter(), and all that follows it.
template <class Coder>
[[gnu::always_inline]] inline void CellCoder<Coder>::enter_swept(const PatternPlan& plan, uint32_t id,
                                                                 size_t at, size_t first_node,
                                                                 CodedCells& out) {
  const uint32_t slot = hull_.add_hexahedron(cell_.corner.data(), plan.glued, plan.opened, ordinal_);
  out.kinds[at] = plan.kind;
  out.begin[at] = static_cast<uint32_t>(first_node);
  out.cell_slots[at] = slot;
  std::copy_n(cell_.corner.begin(), most_corners, out.nodes.begin() + static_cast<ptrdiff_t>(first_node));
  std::array<uint32_t, most_faces> across;
  across.fill(no_slot);
  for (unsigned k = 0; k < plan.glues; ++k) {
    const unsigned f = plan.glue[k].own;
    Hull::Cell& other = hull_.cell(cell_.glue[f].cell);
    other.open = static_cast<uint8_t>(other.open & ~(1u << plan.glue[k].face));
    across[f] = cell_.glue[f].cell;
    successors_[f] = other.successor != no_slot ? CellRef{other.successor, other.ordinal + 1} : CellRef{};
  }
  out.across[at] = across;
  Hull::Cell& cell = hull_.cell(slot);
  cell.pattern = id;
  cell.signature = patterns_.signature(id);
  hull_.cell(last_.slot).successor = slot;
  last_ = {slot, ordinal_++};
  recent_cells_[last_.ordinal % recent_cells_.size()] = last_;
  for (unsigned final = plan.final; final != 0; final &= final - 1) {
    const uint32_t point = cell_.corner[static_cast<unsigned>(__builtin_ctz(final))];
    if (hull_.point(point).alive) end_point(point, out);
  }
}

template size_t CellCoder<RangeEncoder>::sweep(RangeEncoder&, RangeEncoder&, const uint64_t*, const uint8_t*,
                                               size_t, CodedCells&);
template size_t CellCoder<RangeDecoder>::sweep(RangeDecoder&, RangeDecoder&, const uint64_t*, const uint8_t*,
                                               size_t, CodedCells&);

}  // namespace maille
