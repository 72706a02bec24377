// The fastest path of the cell coder: in a structured mesh cell after cell has the pattern of the cell one
// row back, which is the first candidate. Whatever else can be is left to code().
#include "base/bytes.h"
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

/// Flags of eight nodes, a byte for each: 0x80 where there is one.
uint64_t ends_of(const uint8_t* flags) {
  constexpr uint64_t low = 0x7f7f7f7f7f7f7f7f;
  const auto bytes = load<uint64_t>(reinterpret_cast<const std::byte*>(flags));
  return (((bytes & low) + low) | bytes) & ~low;
}

}  // namespace

template <class Coder>
size_t CellCoder<Coder>::sweep(Coder& topology, Coder& numbers, const uint64_t* points,
                               const uint8_t* last_use, size_t most, CodedCells& out) {
  if (damaged_ || faces_ || indices_ || gates_) return 0;
  const size_t before = out.size(), nodes_before = out.nodes.size();
  size_t done = 0, room = 0;
  cell_.kind = hexahedron_kind;
  followed_ = 0;
  for (unsigned f = 0; f < most_faces; ++f) followed_ |= (successors_[f].slot != no_slot ? 1u : 0u) << f;
  while (done < most && hull_.valid(last_)) {
    const uint32_t id = find_swept_sources();
    const PatternPlan& plan = patterns_[id];
    if (!plan.sweeps || !put_together(plan)) break;
    bool hit = false;
    if constexpr (encoding) hit = plan.ends == ends_of(last_use) && has_corners(plan, points);
    hit = pattern_flags_[((id & 511) * 12 + swept_agreement_) * 4 + outcomes_].code(topology, hit);
    outcomes_ = (outcomes_ * 2 + hit) & 3;
    places_passed_ = hit ? 0 : 1;
    if (!hit) break;
    create_swept_corners(plan, numbers, points, static_cast<uint32_t>(before + done), out);
    if (damaged_) break;
    if (done == room) {
      room = done + at_once < most ? done + at_once : most;
      make_room(out, before + room, nodes_before + room * most_corners);
    }
    enter_swept(plan, id, before + done, nodes_before + done * most_corners, out);
    ++done;
    if constexpr (encoding) {
      points += most_corners;
      last_use += most_corners;
    }
  }
  make_room(out, before + done, nodes_before + done * most_corners);
  for (unsigned f = 0; f < most_faces; ++f) {
    if ((followed_ >> f & 1) == 0) successors_[f] = {};
  }
  if (done > 0) last_kind_ = hexahedron_kind;
  return done;
}

/// As find_sources(); the first candidate of code_by_pattern(), none if it cannot be taken.
template <class Coder>
[[gnu::always_inline]] inline uint32_t CellCoder<Coder>::find_swept_sources() {
  uint32_t newest_age = 0xffffffff, oldest_age = 0, newest = 0, oldest = 0;
  sources_.cell[0] = last_.slot;
  sources_.there = 1;
  for (unsigned faces = followed_; faces != 0; faces &= faces - 1) {
    const auto f = static_cast<unsigned>(__builtin_ctz(faces));
    const CellRef& next = successors_[f];
    const Hull::Cell& cell = hull_.cell(next.slot);
    if (cell.ordinal != next.ordinal || cell.live == 0) continue;
    sources_.cell[f + 1] = next.slot;
    sources_.there |= 2u << f;
    const uint32_t age = ordinal_ - cell.ordinal;
    if (age < newest_age) newest = cell.pattern;
    if (age > oldest_age) oldest = cell.pattern;
    newest_age = age < newest_age ? age : newest_age;
    oldest_age = age > oldest_age ? age : oldest_age;
  }
  swept_agreement_ = (newest == oldest ? 1u : 0u) + (newest == hull_.cell(last_.slot).pattern ? 2u : 0u);
  return newest;
}

/// As Patterns::apply().
template <class Coder>
[[gnu::always_inline]] inline bool CellCoder<Coder>::put_together(const PatternPlan& plan) {
  if ((plan.sources & ~sources_.there) != 0) return false;
  std::array<const Hull::Cell*, source_count> source;
  for (unsigned there = sources_.there; there != 0; there &= there - 1) {
    const auto s = static_cast<unsigned>(__builtin_ctz(there));
    source[s] = &hull_.cell(sources_.cell[s]);
  }
  bool good = true;
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
  cell_.fresh = plan.fresh;
  cell_.glued = plan.glued;
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
    // Those that are known are in memory.
    for (unsigned j = 0; j < i && plan.fresh != 1u << i; ++j) {
      if (points[j] == points[i]) return false;
    }
  }
  return true;
}

/// As create_corners().
template <class Coder>
[[gnu::always_inline]] inline void CellCoder<Coder>::create_swept_corners(const PatternPlan& plan,
                                                                          Coder& numbers,
                                                                          const uint64_t* points,
                                                                          uint32_t cell, CodedCells& out) {
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
  // In place: a copy of what was just written number by number would have to wait for it.
  std::array<uint32_t, most_faces>& across = out.across[at];
  across.fill(no_slot);
  followed_ = 0;
  for (unsigned k = 0; k < plan.glues; ++k) {
    const unsigned f = plan.glue[k].own;
    Hull::Cell& other = hull_.cell(cell_.glue[f].cell);
    other.open = static_cast<uint8_t>(other.open & ~(1u << plan.glue[k].face));
    across[f] = cell_.glue[f].cell;
    successors_[f] = {other.successor, other.ordinal + 1};
    followed_ |= (other.successor != no_slot ? 1u : 0u) << f;
  }
  Hull::Cell& cell = hull_.cell(slot);
  cell.pattern = id;
  cell.signature = signature_ = patterns_.signature(id);
  last_signatures_ = {signature_, last_signatures_[0], last_signatures_[1]};
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
