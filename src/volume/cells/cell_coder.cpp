// The frame of the cell coder and its fast path; the slow path is in cell_coder_slow.cpp (where a cell lies)
// and cell_coder_corners.cpp (the points that this leaves open).
#include "volume/cells/cell_coder.h"

#include <bit>
#include <utility>

namespace maille {

void CodedCells::clear() {
  kinds.clear();
  loose_types.clear();
  begin.clear();
  nodes.clear();
  cell_slots.clear();
  across.clear();
  points.clear();
  removed.clear();
}

template <class Coder>
// The order of the steps is that of docs/format.md, 16.4: corners and glue, numbers of new points, nodes
// behind corners, the cell into memory, ends of points. Two coders run beside each other, as numbers have
// statistics of their own and may be absent.
bool CellCoder<Coder>::code(Coder& topology, Coder& numbers, StreamedCell& cell, CodedCells& out) {
  if (damaged_) return false;
  // Before anything is coded, as it only changes how the encoder says the cell.
  if (encoding && faces_) prefer_faces(cell);
  wanted_ = &cell;
  // The sources are looked up once: the pattern, the slow path and the description of a new pattern must see
  // the same ones.
  repeated_ = 0;
  if (gates_) return code_by_gates(topology, numbers, cell, out);
  find_sources();
  const bool fast = code_by_pattern(topology, cell);
  const bool plain = fast && cell_.shape().nodes == cell_.shape().corners;
  Pattern pattern;
  bool described = false;
  if (!fast) {
    signature_ = 0;
    code_slowly(topology, cell);
    if (damaged_) return false;
    if (cell_.kind >= shape_count) return code_without_shape(topology, numbers, cell, out);
    described = repeated_ == 0 && Patterns::describe(cell_, hull_, sources_, pattern);
  } else if (Patterns::is_nearer(patterns_[pattern_], sources_, cell_)) {
    // Made at a seam of blocks, where there was no source: cells behind the seam shall not search for ever.
    described = Patterns::describe(cell_, hull_, sources_, pattern);
  }
  cell.kind = cell_.kind;
  create_corners(numbers, cell, out);
  if (!plain && cell_.shape().nodes > cell_.shape().corners) code_extra_nodes(topology, numbers, cell, out);
  if (damaged_) return false;
  enter(out);
  if (fast) {
    // The pattern says which points end. A decoder learns it here, an encoder checked it in fits().
    if constexpr (!encoding) cell.final = patterns_[pattern_].final;
    signature_ = patterns_.signature(pattern_);
  }
  if (!plain) code_finals(topology, cell, !fast);
  // Only now, as the pattern includes the ends of points, which are coded behind its corners. A full table of
  // patterns is no error: the cell keeps pattern 0, which nothing proposes.
  if (described) {
    pattern.final = static_cast<uint8_t>(cell.final & ((1u << cell_.shape().corners) - 1));
    const uint32_t added = patterns_.add(pattern, signature_);
    pattern_ = added != 0 || !fast ? added : pattern_;
  } else if (!fast) {
    pattern_ = 0;
  }
  Hull::Cell& entered = hull_.cell(last_.slot);
  entered.pattern = pattern_;
  entered.signature = signature_;
  if (faces_ && cell_.shape().dimension == 3) faces_->close_under(*this, last_.slot);
  last_signature_ = signature_;
  if (!fast) follow_group();
  remove_final(cell, out);
  return true;
}

template <class Coder>
bool CellCoder<Coder>::code_without_shape(Coder& topology, Coder& numbers, StreamedCell& cell,
                                          CodedCells& out) {
  if (cell_.kind == isolated_point) return code_isolated(numbers, cell, out);
  if (cell_.kind == loose_cell) return code_loose(topology, numbers, cell, out);
  if (cell_.kind == ended_point) return code_end(topology, cell, out);
  return code_by_faces(topology, numbers, cell, out);
}

/// Fills `sources_` with those that are still in memory: the last cell, and the cell that came after its
/// neighbour across each face. In a sweep these are the neighbours of the next cell in the row, the row
/// before and the layer before.
template <class Coder>
void CellCoder<Coder>::find_sources() {
  sources_.there = 0;
  const auto put = [&](unsigned source, const CellRef& ref) {
    const bool valid = hull_.valid(ref);
    sources_.cell[source] = valid ? ref.slot : no_slot;
    sources_.there |= (valid ? 1u : 0u) << source;
  };
  put(0, last_);
  for (unsigned f = 0; f < most_faces; ++f) put(f + 1, successors_[f]);
}

template <class Coder>
bool CellCoder<Coder>::code_by_pattern(Coder& coder, const StreamedCell& cell) {
  // The row before is the newest of the cells next to the last one, the layer before the oldest.
  uint32_t newest_age = 0xffffffff, oldest_age = 0;
  std::array<uint32_t, 3> candidate{};
  for (unsigned left = sources_.there & ~1u; left != 0; left &= left - 1) {
    // Ages are differences modulo 2^32, so they stay right when ordinals wrap.
    const Hull::Cell& source = hull_.cell(sources_.cell[static_cast<unsigned>(__builtin_ctz(left))]);
    const uint32_t age = ordinal_ - source.ordinal;
    if (age < newest_age) candidate[0] = source.pattern;
    if (age > oldest_age) candidate[1] = source.pattern;
    newest_age = age < newest_age ? age : newest_age;
    oldest_age = age > oldest_age ? age : oldest_age;
  }
  if ((sources_.there & 1) != 0) candidate[2] = hull_.cell(sources_.cell[0]).pattern;
  const unsigned agreement =
      (candidate[0] == candidate[1] ? 1u : 0u) + (candidate[0] == candidate[2] ? 2u : 0u);
  // places_passed_ is 1 where sweep() has already asked about the first candidate and got a no: it must not
  // be asked twice, as the decoder would not ask again either.
  for (unsigned rank = std::exchange(places_passed_, 0); rank < 3; ++rank) {
    const uint32_t id = candidate[rank];
    // Pattern 0 is none, and a candidate that equals an earlier one has been refused already.
    if (id == 0 || (rank > 0 && id == candidate[0]) || (rank > 1 && id == candidate[1])) continue;
    const PatternPlan& plan = patterns_[id];
    // A pattern that does not apply here is skipped without a decision, which both sides see alike.
    if (!Patterns::apply(plan, hull_, sources_, cell_)) continue;
    bool hit = false;
    if constexpr (encoding) hit = fits(plan, cell_, cell);
    RunModel& flag = pattern_flags_[(((id & 511) * 3 + rank) * 4 + agreement) * 4 + outcomes_];
    hit = flag.code(coder, hit);
    outcomes_ = (outcomes_ * 2 + hit) & 3;
    pattern_ = id;
    if (hit) return true;
  }
  return false;
}

/// Encoder: whether the cell is what the pattern makes of it. New corners must really be new, and all
/// different: a pattern gives each of them a point of its own.
template <class Coder>
bool CellCoder<Coder>::fits(const PatternPlan& pattern, const Assembly& guess, const StreamedCell& cell) {
  const unsigned corners = guess.shape().corners;
  if (pattern.kind != cell.kind || pattern.final != (cell.final & ((1u << corners) - 1))) return false;
  for (unsigned i = 0; i < corners; ++i) {
    if (guess.has(i) && input_number(guess.corner[i]) != cell.number[i]) return false;
  }
  for (unsigned fresh = guess.fresh; fresh != 0; fresh &= fresh - 1) {
    const auto i = static_cast<unsigned>(__builtin_ctz(fresh));
    if (slot_of_input(cell.number[i], i) != no_slot) return false;
    for (unsigned j = 0; j < i; ++j) {
      if (cell.number[j] == cell.number[i]) return false;
    }
  }
  return true;
}

/// The number that continues a regular numbering, a + b - d over the first parallelogram of three known
/// corners. It wraps modulo 2^64 on both sides.
template <class Coder>
bool CellCoder<Coder>::expected_number(unsigned corner, uint64_t& number) const {
  const CellShape& shape = cell_.shape();
  for (unsigned i = 0; i < shape.parallelograms[corner]; ++i) {
    const auto& p = shape.parallelogram[corner][i];
    if (!cell_.has(p.a) || !cell_.has(p.b) || !cell_.has(p.opposite)) continue;
    number =
        number_of(cell_.corner[p.a]) + number_of(cell_.corner[p.b]) - number_of(cell_.corner[p.opposite]);
    return true;
  }
  return false;
}

/// Codes the number of a new point and enters it. Without kept numbers the point is numbered in the order in
/// which points come up, which takes no bits.
template <class Coder>
uint32_t CellCoder<Coder>::create_point(Coder& numbers, uint64_t number, bool has_expected, uint64_t expected,
                                        unsigned context, unsigned corner) {
  const uint64_t input = number;
  const auto others = [&](auto suggest) { suggest_as_last(corner, suggest); };
  number = numbered_ ? numbering_.code(numbers, number, has_expected, expected, context, others) : counted_;
  const uint32_t slot = enter_point(number, input);
  if (damaged_) return 0;
  if (gates_) gates_->enter_point(hull_, slot);
  if (encoding && gates_) {
    // Grows by half, as numbers may come in any order. The caller bounds them: encoders with gates hold the
    // mesh.
    if (input >= dense_.size()) dense_.resize(input + input / 2 + 1024, no_slot);
    dense_[input] = slot;
  }
  return slot;
}

template <class Coder>
void CellCoder<Coder>::create_corners(Coder& numbers, StreamedCell& cell, CodedCells& out) {
  const bool several = (cell_.fresh & (cell_.fresh - 1)) != 0;
  // Repetitions of a new corner come behind it, and have no value before it has.
  unsigned without_value = cell_.fresh;
  for (unsigned i = 0; i < cell_.shape().corners && repeated_ != 0; ++i) {
    if ((repeated_ >> i & 1) != 0 && cell_.is_fresh(repeat_of_[i])) without_value |= 1u << i;
  }
  for (unsigned fresh = cell_.fresh; fresh != 0 && !damaged_; fresh &= fresh - 1) {
    const auto i = static_cast<unsigned>(__builtin_ctz(fresh));
    // Corners that repeat a new one are entered in the order of corners, too, but they take its slot and no
    // number.
    NewPoint& point = out.points.emplace_back();
    point.cell = static_cast<uint32_t>(out.size());
    point.node = static_cast<uint8_t>(i);
    point.fresh = static_cast<uint8_t>(without_value);
    // Only the value of a corner without a full parallelogram is ever predicted from points behind
    // (docs/format.md, 16.7).
    if (several || cell_.shape().parallelograms[i] == 0) points_behind(point, i);
    uint64_t expected = 0;
    const bool has_expected = expected_number(i, expected);
    point.slot = create_point(numbers, cell.number[i], has_expected, expected, i + (several ? 8 : 0), i);
    if (damaged_) return;
    point.number = encoding ? input_number(point.slot) : number_of(point.slot);
    cell_.set_corner(i, point.slot);
  }
  for (unsigned i = 0; i < cell_.shape().corners && repeated_ != 0; ++i) {
    if ((repeated_ >> i & 1) != 0) cell_.set_corner(i, cell_.corner[repeat_of_[i]]);
  }
  for (unsigned i = 0; i < cell_.shape().corners; ++i) {
    node_[i] = cell_.corner[i];
    if constexpr (!encoding) cell.number[i] = number_of(node_[i]);
  }
}

/// Finds for each axis neighbour n, seen from the new corner, the point behind it: n's other neighbour along
/// that edge, in the cell across the face that has n and not the corner. 2n - b then continues a straight row
/// where there is no parallelogram.
template <class Coder>
void CellCoder<Coder>::points_behind(NewPoint& point, unsigned corner) const {
  const CellShape& shape = cell_.shape();
  unsigned count = 0;
  for (unsigned n = shape.neighbours[corner]; n != 0 && count < 3; n &= n - 1, ++count) {
    const auto neighbour = static_cast<unsigned>(__builtin_ctz(n));
    if (!cell_.has(neighbour)) continue;
    const unsigned faces = shape.faces_at[neighbour] & ~shape.faces_at[corner] & cell_.glued;
    if (faces == 0) continue;
    const FaceRef across = cell_.glue[static_cast<unsigned>(__builtin_ctz(faces))];
    const Hull::Cell& other = hull_.cell(across.cell);
    const CellShape& other_shape = Hull::shape_of(other);
    for (unsigned j = 0; j < other_shape.corners; ++j) {
      if (other.corner[j] != cell_.corner[neighbour]) continue;
      unsigned on_face = 0;
      for (unsigned k = 0; k < other_shape.face[across.face].size; ++k) {
        on_face |= 1u << other_shape.face[across.face].corner[k];
      }
      const unsigned behind = other_shape.neighbours[j] & ~on_face;
      if (behind != 0) point.behind[count] = other.corner[static_cast<unsigned>(__builtin_ctz(behind))];
      break;
    }
  }
}

/// The cell comes into memory: faces that it is glued to close, it is linked as the successor of the last
/// cell, and the successors of its neighbours become the sources of the next one.
template <class Coder>
void CellCoder<Coder>::enter(CodedCells& out) {
  const CellShape& shape = cell_.shape();
  out.kinds.push_back(static_cast<uint8_t>(cell_.kind));
  out.begin.push_back(static_cast<uint32_t>(out.nodes.size()));
  out.nodes.insert(out.nodes.end(), node_.begin(), node_.begin() + shape.nodes);
  std::array<uint32_t, most_faces> across;
  across.fill(no_slot);
  for (unsigned f = 0; f < shape.faces; ++f) {
    successors_[f] = {};
    if (!cell_.is_glued(f)) continue;
    Hull::Cell& other = hull_.cell(cell_.glue[f].cell);
    other.open = static_cast<uint8_t>(other.open & ~(1u << cell_.glue[f].face));
    across[f] = cell_.glue[f].cell;
    // Taken before this cell gets into memory, as it may itself become the successor of one of these.
    if (other.successor != no_slot) successors_[f] = {other.successor, other.ordinal + 1};
  }
  for (unsigned f = shape.faces; f < most_faces; ++f) successors_[f] = {};
  const uint32_t slot = hull_.add_cell(cell_.kind, cell_.corner.data(), cell_.glued, ordinal_);
  if (hull_.valid(last_)) hull_.cell(last_.slot).successor = slot;
  last_ = {slot, ordinal_++};
  last_kind_ = cell_.kind;
  dimensions_ |= 1u << shape.dimension;
  recent_cells_[last_.ordinal % recent_cells_.size()] = last_;
  out.cell_slots.push_back(slot);
  out.across.push_back(across);
  if (shape.nodes == shape.corners) return;
  if (slot >= extra_.size()) extra_.resize(hull_.cell_capacity());
  for (unsigned i = shape.corners; i < shape.nodes; ++i) extra_[slot][i - shape.corners] = node_[i];
}

/// Points whose last use this cell is leave memory. Ends are told for each corner, so that a corner that
/// repeats another may have ended already.
template <class Coder>
void CellCoder<Coder>::remove_final(const StreamedCell& cell, CodedCells& out) {
  for (uint32_t final = cell.final; final != 0; final &= final - 1) {
    const uint32_t slot = node_[static_cast<unsigned>(__builtin_ctz(final))];
    if (hull_.point(slot).alive()) end_point(slot, out);  // else a corner that repeats another
  }
}

template <class Coder>
void CellCoder<Coder>::end_point(uint32_t slot, CodedCells& out) {
  if (encoding && gates_) dense_[input_numbers_[slot]] = no_slot;
  if (faces_) faces_->store().remove_point(slot, hull_);
  leave_point(slot, out);
}

/// Encoder: triangles and quads that lie on faces of polyhedra are coded as those are, because only the
/// memory of faces (FaceStore) knows such a face, and the polygon then costs little more than a yes.
template <class Coder>
void CellCoder<Coder>::prefer_faces(StreamedCell& cell) {
  if (cell.kind >= shape_count || cell_shapes[cell.kind].nodes > 4) return;
  const CellType shape = cell_shapes[cell.kind].type;
  if (shape != CellType::triangle && shape != CellType::quad) return;
  const unsigned nodes = cell_shapes[cell.kind].nodes;
  cell.numbers.assign(cell.number.begin(), cell.number.begin() + nodes);
  if (!faces_->lies_on_face(*this, cell.numbers)) return;
  cell.kind = face_cell;
  cell.finals.clear();
  for (unsigned i = 0; i < nodes; ++i) cell.finals.push_back(cell.final >> i & 1);
}

/// The memory of faces exists from the first such cell on: streams without any do not pay for it.
template <class Coder>
bool CellCoder<Coder>::code_by_faces(Coder& topology, Coder& numbers, StreamedCell& cell, CodedCells& out) {
  if (!faces_) faces_ = std::make_unique<FaceCoder<Coder>>(mixing_);
  cell.kind = last_kind_ = face_cell;
  return faces_->code(*this, topology, numbers, cell, out);
}

/// A point ends where no cell could say so: its last cell is already coded. Its number is told as a
/// difference to the last group, which follows the ends.
template <class Coder>
bool CellCoder<Coder>::code_end(Coder& coder, StreamedCell& cell, CodedCells& out) {
  const uint32_t slot = code_old_point(coder, encoding ? slot_of_input(cell.number[0], 0) : no_slot, group_);
  if (damaged_) return false;
  group_ = number_of(slot);
  cell.kind = last_kind_ = ended_point;
  end_point(slot, out);
  return true;
}

/// A point that no cell uses comes up and ends at once: it only serves to put its values into their order.
template <class Coder>
bool CellCoder<Coder>::code_isolated(Coder& numbers, StreamedCell& cell, CodedCells& out) {
  NewPoint point;
  point.slot = create_point(numbers, cell.number[0], false, 0, 32);
  if (damaged_) return false;
  point.number = encoding ? cell.number[0] : number_of(point.slot);
  out.points.push_back(point);
  cell.kind = isolated_point;
  cell.final = 1;
  node_[0] = point.slot;
  last_kind_ = isolated_point;
  remove_final(cell, out);
  return true;
}

// Not the whole class: GCC 12 with -flto then drops the members that the other files define.
template bool CellCoder<RangeEncoder>::code(RangeEncoder&, RangeEncoder&, StreamedCell&, CodedCells&);
template bool CellCoder<RangeEncoder>::code_without_shape(RangeEncoder&, RangeEncoder&, StreamedCell&,
                                                          CodedCells&);
template void CellCoder<RangeEncoder>::find_sources();
template void CellCoder<RangeEncoder>::create_corners(RangeEncoder&, StreamedCell&, CodedCells&);
template void CellCoder<RangeEncoder>::enter(CodedCells&);
template void CellCoder<RangeEncoder>::remove_final(const StreamedCell&, CodedCells&);
template uint32_t CellCoder<RangeEncoder>::create_point(RangeEncoder&, uint64_t, bool, uint64_t, unsigned,
                                                        unsigned);
template void CellCoder<RangeEncoder>::end_point(uint32_t, CodedCells&);
template bool CellCoder<RangeDecoder>::code(RangeDecoder&, RangeDecoder&, StreamedCell&, CodedCells&);
template bool CellCoder<RangeDecoder>::code_without_shape(RangeDecoder&, RangeDecoder&, StreamedCell&,
                                                          CodedCells&);
template void CellCoder<RangeDecoder>::find_sources();
template void CellCoder<RangeDecoder>::create_corners(RangeDecoder&, StreamedCell&, CodedCells&);
template void CellCoder<RangeDecoder>::enter(CodedCells&);
template void CellCoder<RangeDecoder>::remove_final(const StreamedCell&, CodedCells&);
template uint32_t CellCoder<RangeDecoder>::create_point(RangeDecoder&, uint64_t, bool, uint64_t, unsigned,
                                                        unsigned);
template void CellCoder<RangeDecoder>::end_point(uint32_t, CodedCells&);

}  // namespace maille
