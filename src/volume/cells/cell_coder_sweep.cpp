// The fastest path of the cell coder: in a structured mesh cell after cell has the pattern of the cell one
// row back, which is the first candidate. Whatever else can be is left to code(). Each step here is one of
// code()'s for this case alone, with the same effect on hull, models and output: cell_coder_sweep_test.cpp
// holds the two against each other. With it, and values at last corners by a way of their own
// (TupleValueCoder::code_full()), the pipe takes 682 instead of 896 ns a hexahedron for encoding and 581
// instead of 826 for decoding (3d07c57).
#include <cstring>

#include "base/bytes.h"
#include "volume/cells/cell_coder.h"

namespace maille {
namespace {

/// Output is written into room for so many cells at a time, so that no vector checks its size for each of
/// them. Chosen, no sweep is on record: more would write over memory for cells that do not come.
constexpr size_t at_once = 64;

void make_room(CodedCells& out, size_t cells, size_t nodes) {
  out.kinds.resize(cells);
  out.begin.resize(cells);
  out.cell_slots.resize(cells);
  out.across.resize(cells);
  out.nodes.resize(nodes);
}

/// Flags of eight nodes, a byte for each: 0x80 where a byte is not 0. Adding 0x7f to the lower seven bits of
/// a byte carries into the top bit exactly if one of them is set, and never into the next byte.
uint64_t ends_of(const uint8_t* flags) {
  constexpr uint64_t low = 0x7f7f7f7f7f7f7f7f;
  const auto bytes = load<uint64_t>(reinterpret_cast<const std::byte*>(flags));
  return (((bytes & low) + low) | bytes) & ~low;
}

}  // namespace

template <class Coder>
size_t CellCoder<Coder>::sweep(Coder& topology, Coder& numbers, const uint64_t* points,
                               const uint8_t* last_use, size_t most, CodedCells& out) {
  // Polyhedra close faces under hexahedra, and at gates there are no patterns: code() does these.
  if (damaged_ || faces_ || gates_) return 0;
  const size_t before = out.size(), nodes_before = out.nodes.size();
  size_t done = 0, room = 0;
  cell_.kind = hexahedron_kind;
  followed_ = 0;
  // Kept as bits from cell to cell, so that the loop below visits only successors that exist.
  for (unsigned f = 0; f < most_faces; ++f) followed_ |= (successors_[f].slot != no_slot ? 1u : 0u) << f;
  SweptSources sources;
  HexahedronSlots corners;
  uint32_t newest = last_signature_;
  // valid() is false before the first cell and after a cell all of whose points ended.
  while (done < most && hull_.valid(last_)) {
    const uint32_t id = find_swept_sources(sources);
    // Pattern 0 has a plan that does not sweep, so that "no candidate" ends the loop here.
    const PatternPlan& found = patterns_[id];
    if (!found.sweeps || (found.sources & ~sources.there) != 0) break;
    SweptPattern& plan = swept_[id % swept_.size()];
    if (plan.id != id) [[unlikely]]
      plan = SweptPattern(found, id, patterns_.signature(id));
    if (!put_together(plan, sources, corners)) break;
    bool hit = false;
    if constexpr (encoding) hit = plan.ends == ends_of(last_use) && has_corners(plan, corners, points);
    hit = pattern_flags_[((id & 511) * 12 + swept_agreement_) * 4 + outcomes_].code(topology, hit);
    outcomes_ = (outcomes_ * 2 + hit) & 3;
    // A refused candidate has used up its decision: code() must begin with the next one.
    places_passed_ = hit ? 0 : 1;
    if (!hit) break;
    if (plan.fresh != 0) {
      create_swept_corners(plan, sources, corners, numbers, points, static_cast<uint32_t>(before + done),
                           out);
      if (damaged_) break;
    }
    if (done == room) {
      room = done + at_once < most ? done + at_once : most;
      make_room(out, before + room, nodes_before + room * most_corners);
    }
    enter_swept(plan, sources, corners, before + done, nodes_before + done * most_corners, out);
    ++done;
    newest = plan.signature;
    if constexpr (encoding) {
      points += most_corners;
      last_use += most_corners;
    }
  }
  make_room(out, before + done, nodes_before + done * most_corners);
  for (unsigned f = 0; f < most_faces; ++f) {
    if ((followed_ >> f & 1) == 0) successors_[f] = {};
  }
  // What code() would have left behind after the last of these cells; in between nobody reads it.
  if (done > 0) {
    last_kind_ = hexahedron_kind;
    last_signature_ = signature_ = newest;
  }
  // Only the last sixteen can be asked for.
  for (size_t k = done < recent_cells_.size() ? done : recent_cells_.size(); k-- > 0;) {
    const auto ordinal = static_cast<uint32_t>(last_.ordinal - k);
    recent_cells_[ordinal % recent_cells_.size()] = {out.cell_slots[before + done - 1 - k], ordinal};
  }
  return done;
}

/// As find_sources(); the first candidate of code_by_pattern(), none if it cannot be taken.
template <class Coder>
[[gnu::always_inline]] inline uint32_t CellCoder<Coder>::find_swept_sources(SweptSources& sources) {
  uint32_t newest_age = 0xffffffff, oldest_age = 0, newest = 0, oldest = 0;
  const Hull::Cell& last = hull_.cell(last_.slot);
  sources.cell[0] = &last;
  sources.slot[0] = last_.slot;
  sources.there = 1;
  for (unsigned faces = followed_; faces != 0; faces &= faces - 1) {
    const auto f = static_cast<unsigned>(__builtin_ctz(faces));
    const CellRef& next = successors_[f];
    const Hull::Cell& cell = hull_.cell(next.slot);
    if (cell.ordinal != next.ordinal || cell.live == 0) continue;
    sources.cell[f + 1] = &cell;
    sources.slot[f + 1] = next.slot;
    sources.there |= 2u << f;
    const uint32_t age = ordinal_ - cell.ordinal;
    newest = age < newest_age ? cell.pattern : newest;
    oldest = age > oldest_age ? cell.pattern : oldest;
    newest_age = age < newest_age ? age : newest_age;
    oldest_age = age > oldest_age ? age : oldest_age;
  }
  swept_agreement_ = (newest == oldest ? 1u : 0u) + (newest == last.pattern ? 2u : 0u);
  return newest;
}

/// As Patterns::apply(), given that the sources are there. Takes of a new corner the slot of one that is
/// known (SweptPattern::from), so that the loop has no branches; it is replaced when the point is made.
template <class Coder>
[[gnu::always_inline]] inline bool CellCoder<Coder>::put_together(const SweptPattern& plan,
                                                                  const SweptSources& sources,
                                                                  HexahedronSlots& corners) {
  auto& slot = corners.slot;
  const auto take = [&](unsigned i) {
    slot[i] = sources.cell[plan.from[i].source]->corner[plan.from[i].corner];
  };
  // Written out, as loops of eight with a known bound are kept as loops by compilers here.
  take(0), take(1), take(2), take(3), take(4), take(5), take(6), take(7);
  corners.low = Lanes{slot[0], slot[1], slot[2], slot[3]};
  corners.high = Lanes{slot[4], slot[5], slot[6], slot[7]};
  // A corner whose point has left is no_slot: one comparison for four corners at a time.
  const auto gone = (corners.low == no_slot) | (corners.high == no_slot);
  std::array<uint64_t, 2> any;
  std::memcpy(&any, &gone, sizeof any);
  unsigned open = 1;
  for (unsigned k = 0; k < plan.glues; ++k)
    open &= static_cast<unsigned>(sources.cell[plan.glue[k].source]->open) >> plan.glue[k].face;
  return (any[0] | any[1]) == 0 && open != 0;
}

/// Encoder: fits(), but for the ends.
template <class Coder>
[[gnu::always_inline]] inline bool CellCoder<Coder>::has_corners(const SweptPattern& plan,
                                                                 const HexahedronSlots& corners,
                                                                 const uint64_t* points) {
  uint64_t different = 0;
  // All eight are compared, and those that are not known are masked out: cheaper than branches.
  const auto compare = [&](unsigned i) {
    different |= (input_number(corners.slot[i]) ^ points[i]) & plan.is_known[i];
  };
  compare(0), compare(1), compare(2), compare(3), compare(4), compare(5), compare(6), compare(7);
  if (different != 0) return false;
  for (unsigned fresh = plan.fresh; fresh != 0; fresh &= fresh - 1) {
    const auto i = static_cast<unsigned>(__builtin_ctz(fresh));
    if (slot_of_input(points[i], i) != no_slot) return false;
    // Those that are known are in memory.
    for (unsigned j = 0; j < i && plan.several; ++j) {
      if (points[j] == points[i]) return false;
    }
  }
  return true;
}

/// As create_corners(). `corners` gets the slots of the new points.
template <class Coder>
[[gnu::always_inline]] inline void CellCoder<Coder>::create_swept_corners(
    const SweptPattern& plan, const SweptSources& sources, HexahedronSlots& corners, Coder& numbers,
    const uint64_t* points, uint32_t cell, CodedCells& out) {
  // What guesses are made from, if the first is wrong.
  sources_.cell[0] = sources.slot[0];
  cell_.known = plan.known;
  std::memcpy(cell_.corner.data(), &corners.low, sizeof corners.low);
  std::memcpy(cell_.corner.data() + 4, &corners.high, sizeof corners.high);
  if (plan.several) {
    cell_.glued = plan.glued;
    for (unsigned k = 0; k < plan.glues; ++k)
      cell_.glue[plan.glue[k].own] = {sources.slot[plan.glue[k].source], plan.glue[k].face};
  }
  for (unsigned fresh = plan.fresh; fresh != 0 && !damaged_; fresh &= fresh - 1) {
    const auto i = static_cast<unsigned>(__builtin_ctz(fresh));
    // In place: a copy of what was just written number by number would have to wait for it.
    NewPoint& point = out.points.emplace_back();
    point.cell = cell;
    point.node = static_cast<uint8_t>(i);
    point.fresh = plan.fresh;
    if (plan.several) points_behind(point, i);
    const bool expects = (plan.expects >> i & 1) != 0;
    const CellShape::Parallelogram& p = plan.expected[i];
    const uint64_t expected = expects ? number_of(corners.slot[p.a]) + number_of(corners.slot[p.b]) -
                                            number_of(corners.slot[p.opposite])
                                      : 0;
    const uint64_t input = encoding ? points[i] : 0;
    const auto others = [&](auto suggest) { suggest_as_last(i, suggest); };
    const unsigned context = i + (plan.several ? 8 : 0);
    const uint64_t number =
        numbered_ ? numbering_.code(numbers, input, expects, expected, context, others) : counted_;
    const uint32_t slot = enter_point(number, input);
    point.slot = slot;
    point.number = encoding ? input : number;
    corners.slot[i] = slot;
    cell_.set_corner(i, slot);
  }
}

/// As enter() and all that follows it: glued faces close, the successors of neighbours become the next
/// sources, points that end leave.
template <class Coder>
[[gnu::always_inline]] inline void CellCoder<Coder>::enter_swept(const SweptPattern& plan,
                                                                 const SweptSources& sources,
                                                                 const HexahedronSlots& corners, size_t at,
                                                                 size_t first_node, CodedCells& out) {
  const uint32_t slot = hull_.add_hexahedron(corners.slot, plan.entered, plan.glued, ordinal_);
  Hull::Cell& cell = hull_.cell(slot);
  uint32_t* const nodes = out.nodes.data() + first_node;
  // Copied as four and four from registers. The usual pattern has one new corner at most, which is set over
  // the copy; several are set one by one.
  for (uint32_t* const to : {cell.corner.data(), nodes}) {
    std::memcpy(to, &corners.low, sizeof corners.low);
    std::memcpy(to + 4, &corners.high, sizeof corners.high);
    to[plan.first_fresh] = corners.slot[plan.first_fresh];
  }
  for (unsigned i = 0; i < most_corners && plan.several; ++i) cell.corner[i] = nodes[i] = corners.slot[i];
  out.kinds[at] = hexahedron_kind;
  out.begin[at] = static_cast<uint32_t>(first_node);
  out.cell_slots[at] = slot;
  std::array<uint32_t, most_faces>& across = out.across[at];
  across.fill(no_slot);
  unsigned followed = 0;
  for (unsigned k = 0; k < plan.glues; ++k) {
    const PatternPlan::Glue& from = plan.glue[k];
    const uint32_t other_slot = sources.slot[from.source];
    Hull::Cell& other = hull_.cell(other_slot);
    other.open = static_cast<uint8_t>(other.open & ~(1u << from.face));
    across[from.own] = other_slot;
    successors_[from.own] = {other.successor, other.ordinal + 1};
    followed |= (other.successor != no_slot ? 1u : 0u) << from.own;
  }
  followed_ = followed;
  cell.pattern = plan.id;
  cell.signature = plan.signature;
  hull_.cell(last_.slot).successor = slot;
  last_ = {slot, ordinal_++};
  for (unsigned final = plan.final; final != 0; final &= final - 1) {
    const uint32_t point = corners.slot[static_cast<unsigned>(__builtin_ctz(final))];
    if (hull_.point(point).alive()) leave_point(point, out);
  }
}

template size_t CellCoder<RangeEncoder>::sweep(RangeEncoder&, RangeEncoder&, const uint64_t*, const uint8_t*,
                                               size_t, CodedCells&);
template size_t CellCoder<RangeDecoder>::sweep(RangeDecoder&, RangeDecoder&, const uint64_t*, const uint8_t*,
                                               size_t, CodedCells&);

}  // namespace maille
