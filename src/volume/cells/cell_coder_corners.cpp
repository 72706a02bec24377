// The end of the slow path: what no face gave. Corners, nodes behind the corners, points that no later cell
// has, and cells without shared faces, in the order in which docs/format.md, 16.6, has the steps.
#include <algorithm>

#include "volume/cells/cell_coder.h"

namespace maille {

// Corners that no face gave.

/// Each corner that no face gave is, in this order of questions: a repetition, a new point, one that an edge
/// joins to a known neighbour, or any point in memory by its number. Cheap and likely answers come first; the
/// last one can name every point, so that no topology is out of reach.
template <class Coder>
void CellCoder<Coder>::code_corners(Coder& coder) {
  const CellShape& shape = cell_.shape();
  for (unsigned i = 0; i < shape.corners && !damaged_; ++i) {
    if (cell_.has(i)) continue;
    if (code_repeat(coder, i)) continue;
    // The apex of a pyramid has four neighbours, others three at most: four share a bit with the count of
    // glued faces, on both sides alike.
    const auto joined = bits_in(shape.neighbours[i] & cell_.known);
    const auto glued = bits_in(cell_.glued);
    const uint32_t local = i | joined << 3 | glued << 5 | (cell_.fresh != 0 ? 256u : 0) | cell_.kind << 9;
    uint32_t valence = 0;
    for (unsigned n = shape.neighbours[i] & cell_.known; n != 0; n &= n - 1) {
      // Four bits for each known neighbour, of which there are four at most.
      valence = valence * 16 +
                std::min<uint32_t>(
                    hull_.point(cell_.corner[static_cast<unsigned>(__builtin_ctz(n))]).valence(), 15);
    }
    bool fresh = false;
    if constexpr (encoding) fresh = target_[i] == no_slot;
    if (decide(coder, fresh, is_new, local, anchor_signature_, valence * 8 + i)) {
      cell_.fresh |= 1u << i;
      continue;
    }
    if (code_joined(coder, i)) continue;
    // The corner at the same place of the last cell is in a mesh with rows mostly near in number; where there
    // is none, the group is.
    uint64_t base = group_;
    if (sources_.cell[0] != no_slot && hull_.cell(sources_.cell[0]).corner[i] != no_slot) {
      base = number_of(hull_.cell(sources_.cell[0]).corner[i]);
    }
    const uint32_t slot = code_old_point(coder, target_[i], base);
    if (!damaged_) cell_.set_corner(i, slot);
  }
}

/// Damaged or odd meshes have cells with a corner twice. Others pay next to nothing for the question, as its
/// context always answers no.
template <class Coder>
bool CellCoder<Coder>::code_repeat(Coder& coder, unsigned corner) {
  const unsigned before = cell_.known | cell_.fresh | repeated_;
  if (before == 0) return false;
  unsigned of = 8;
  if constexpr (encoding) {
    for (unsigned j = 0; j < cell_.shape().corners && of == 8; ++j) {
      if ((before >> j & 1) != 0 && wanted_->number[j] == wanted_->number[corner]) of = j;
    }
  }
  if (!decide(coder, of < 8, repeats, cell_.kind, 0, 0)) return false;
  // Three bits name one of eight corners; a decoder refuses one that has come up in none of the ways there
  // are.
  of = coder.code_raw(of, 3);
  if ((before >> of & 1) == 0) {
    damaged_ = true;
    return true;
  }
  // A corner before this one may be new and without slot; a chain of repetitions leads to one that is not.
  if (cell_.has(of)) {
    cell_.set_corner(corner, cell_.corner[of]);
  }
  repeat_of_[corner] = static_cast<uint8_t>((repeated_ >> of & 1) != 0 ? repeat_of_[of] : of);
  repeated_ |= 1u << corner;
  return true;
}

namespace {

/// The points before and after a corner in each open face there. An edge that no open face has is done with:
/// at gates no later cell can have it.
template <class Add>
void for_each_in_open_faces(const Hull::Cell& cell, unsigned corner, Add add) {
  const CellShape& shape = Hull::shape_of(cell);
  for (unsigned faces = cell.open & shape.faces_at[corner]; faces != 0; faces &= faces - 1) {
    const CellShape::Beside& beside = shape.beside[static_cast<unsigned>(__builtin_ctz(faces))][corner];
    add(cell.corner[beside.before]);
    add(cell.corner[beside.after]);
  }
}

}  // namespace

/// Collects the points that an edge joins to known corners next to this one, those joined to most of them
/// first; returns how many may be asked about, twelve at most. 48 cells (and 48 faces in memory) around each
/// known neighbour, of which there are three, or four at the apex of a pyramid, 24 points and 12 questions
/// bound the work. These numbers are part of the format.
template <class Coder>
unsigned CellCoder<Coder>::joined_points(unsigned corner) {
  unsigned count = 0;
  constexpr uint8_t own = 255;
  // One byte for each point instead of a search of the list: 255 for corners of the cell itself, which cannot
  // be meant, else 1 + the place in the list. Only what was set is cleared again.
  if (joined_places_.size() < hull_.point_capacity()) joined_places_.resize(hull_.point_capacity());
  const auto mark_own = [&](uint8_t mark) {
    for (unsigned known = cell_.known; known != 0; known &= known - 1)
      joined_places_[cell_.corner[static_cast<unsigned>(__builtin_ctz(known))]] = mark;
  };
  mark_own(own);
  const auto add = [&](uint32_t slot) {
    const uint8_t place = joined_places_[slot];
    if (place == own) return;
    if (place != 0) {
      uint8_t& times = joined_[place - 1u].second;
      times = static_cast<uint8_t>(times + (times < 255));
    } else if (count < joined_.size()) {
      joined_[count++] = {slot, uint8_t{1}};
      joined_places_[slot] = static_cast<uint8_t>(count);
    }
  };
  const unsigned dimension = cell_.shape().dimension;
  // Where all cells have one dimension and their faces are in the hull, a point's count of open faces tells
  // when all open faces around it have been seen: the walk ends there instead of at 48.
  const bool open_only = gates_ && dimensions_ == 1u << dimension && !faces_;
  for (unsigned n = cell_.shape().neighbours[corner] & cell_.known; n != 0; n &= n - 1) {
    const uint32_t neighbour = cell_.corner[static_cast<unsigned>(__builtin_ctz(n))];
    unsigned left = 48, open = hull_.point(neighbour).open();
    if (open_only && open == 0) continue;
    hull_.around(neighbour, [&](uint32_t slot, uint32_t at) {
      const Hull::Cell& other = hull_.cell(slot);
      if (gates_ && Hull::shape_of(other).dimension == dimension) {
        for_each_in_open_faces(other, at, add);
        open -= bits_in(other.open & Hull::shape_of(other).faces_at[at]);
        return --left == 0 || (open_only && open == 0);
      }
      for (unsigned m = Hull::shape_of(other).neighbours[at]; m != 0; m &= m - 1) {
        const uint32_t point = other.corner[static_cast<unsigned>(__builtin_ctz(m))];
        if (point != no_slot) add(point);
      }
      return --left == 0;
    });
    if (faces_) {
      left = 48;
      const FaceStore& faces = faces_->store();
      faces.around(cell_.corner[static_cast<unsigned>(__builtin_ctz(n))], [&](uint32_t id, uint32_t place) {
        const uint32_t size = faces.face(id).size;
        for (const uint32_t next : {place + 1 == size ? 0 : place + 1, place == 0 ? size - 1 : place - 1}) {
          if (faces.point(id, next) != no_slot) add(faces.point(id, next));
        }
        return --left == 0;
      });
    }
  }
  // Known corners first, as a corner may be in the list, too, if the cell repeats points.
  mark_own(0);
  for (unsigned i = 0; i < count; ++i) joined_places_[joined_[i].first] = 0;
  // By insertion: stable, and there are few.
  for (unsigned i = 1; i < count; ++i) {
    const auto moving = joined_[i];
    unsigned to = i;
    for (; to > 0 && joined_[to - 1].second < moving.second; --to) joined_[to] = joined_[to - 1];
    joined_[to] = moving;
  }
  return std::min<uint32_t>(count, 12);
}

/// One question for each point that is joined to a known neighbour; in tetrahedra behind a front the first is
/// mostly right.
template <class Coder>
bool CellCoder<Coder>::code_joined(Coder& coder, unsigned corner) {
  const unsigned count = joined_points(corner);
  for (unsigned i = 0; i < count; ++i) {
    const uint32_t slot = joined_[i].first;
    const uint32_t local = i | std::min<uint32_t>(joined_[i].second, 7) << 4 | cell_.kind << 7;
    const uint32_t valence = std::min<uint32_t>(hull_.point(slot).valence(), 31);
    if (!decide(coder, target_[corner] == slot, joined_here, local, anchor_signature_, valence * 16 + i))
      continue;
    cell_.set_corner(corner, slot);
    return true;
  }
  return false;
}

/// A point in memory by its number, as a difference to `base`; returns its slot. The encoder has the slot,
/// the decoder looks it up, and a number that is not in memory is damage. Numbers wrap modulo 2^64, so that
/// any base can lead to any number.
template <class Coder>
uint32_t CellCoder<Coder>::code_old_point(Coder& coder, uint32_t slot, uint64_t base) {
  uint64_t number = encoding ? number_of(slot) : 0;
  number = base + static_cast<uint64_t>(old_point_.code(coder, static_cast<int64_t>(number - base)));
  if constexpr (!encoding) {
    slot = slot_of(number, 15);
    damaged_ = damaged_ || slot == no_slot || coder.exhausted();
  }
  return slot;
}

/// Enters all points in memory into the table by number. This happens once in a stream at most: from then on
/// enter_point() and leave_point() keep the table.
template <class Coder>
void CellCoder<Coder>::fill_table() {
  in_table_ = true;
  hull_.each_point([&](uint32_t slot) { table_.insert(number_of(slot), slot, 8); });
}

/// Faces that nobody asked about, but that close here all the same: all corners are known, and an open face
/// in memory has the same points. Both sides search for themselves, which costs time instead of bits. A point
/// without open faces rules a face out before any search.
template <class Coder>
void CellCoder<Coder>::glue_the_rest() {
  const CellShape& shape = cell_.shape();
  for (unsigned f = 0; f < shape.faces; ++f) {
    if (cell_.is_glued(f) || (shape.corners_of[f] & ~cell_.known) != 0) continue;
    std::array<uint32_t, 4> slots{};
    cell_.known_of(shape.face[f], slots);
    bool open = true;
    for (unsigned i = 0; i < shape.face[f].size; ++i) open = open && hull_.point(slots[i]).open() != 0;
    if (!open) continue;
    const FaceRef found = hull_.find_face(shape.face[f].size, slots.data(), shape.face[f].size);
    if (found.cell != no_slot) cell_.set_glue(f, found);
  }
}

// Nodes behind the corners.

/// The node of a cell in memory that lies between the same corners; no_slot when there is none. Conforming
/// meshes share such nodes as they share corners. The newest cell that has one wins, so that both sides take
/// the same.
template <class Coder>
uint32_t CellCoder<Coder>::extra_node_on(unsigned node) const {
  const unsigned corners = cell_.shape().lies_on[node];
  if ((corners & cell_.fresh) != 0) return no_slot;
  uint32_t found = no_slot;
  hull_.around(cell_.corner[static_cast<unsigned>(__builtin_ctz(corners))], [&](uint32_t slot, uint32_t) {
    const Hull::Cell& other = hull_.cell(slot);
    const CellShape& shape = Hull::shape_of(other);
    for (unsigned i = shape.corners; i < shape.nodes; ++i) {
      if (__builtin_popcount(shape.lies_on[i]) != __builtin_popcount(corners)) continue;
      bool same = true;
      for (unsigned c = corners; c != 0 && same; c &= c - 1) {
        const uint32_t point = cell_.corner[static_cast<unsigned>(__builtin_ctz(c))];
        bool has = false;
        for (unsigned d = shape.lies_on[i]; d != 0; d &= d - 1) {
          has = has || other.corner[static_cast<unsigned>(__builtin_ctz(d))] == point;
        }
        same = has;
      }
      const uint32_t candidate = extra_[slot][i - shape.corners];
      if (same && hull_.point(candidate).alive()) found = candidate;
    }
    return found != no_slot;
  });
  return found;
}

/// Nodes behind the corners (middles of edges, faces, the cell): the one that a neighbour has there, a new
/// one, or any by its number.
template <class Coder>
void CellCoder<Coder>::code_extra_nodes(Coder& coder, Coder& numbers, StreamedCell& cell, CodedCells& out) {
  const CellShape& shape = cell_.shape();
  if constexpr (!encoding) damaged_ = damaged_ || has_no_room_for_nodes();
  for (unsigned i = shape.corners; i < shape.nodes && !damaged_; ++i) {
    const auto size = static_cast<uint32_t>(__builtin_popcount(shape.lies_on[i]));
    const uint32_t candidate = extra_node_on(i);
    uint32_t target = no_slot;
    if constexpr (encoding) target = slot_of_input(cell.number[i], i);
    const uint32_t local = (candidate != no_slot ? 1u : 0) | size << 1 | cell_.kind << 5;
    const bool fresh_corners = (shape.lies_on[i] & cell_.fresh) != 0;
    node_[i] = candidate;
    if (candidate == no_slot || !decide(coder, target == candidate, node_known, local, i, 0)) {
      // Contexts of corners are below 2^16, so that this one is never shared with code_corners().
      if (decide(coder, target == no_slot, is_new, local + 0x10000, i, fresh_corners)) {
        NewPoint point;
        point.cell = static_cast<uint32_t>(out.size());
        point.node = static_cast<uint8_t>(i);
        point.fresh = static_cast<uint8_t>(cell_.fresh);
        point.slot = create_point(numbers, cell.number[i], false, 0, 33 + i);
        point.number = damaged_ ? 0 : encoding ? cell.number[i] : number_of(point.slot);
        node_[i] = point.slot;
        if (!damaged_) out.points.push_back(point);
      } else {
        node_[i] = code_old_point(coder, target, number_of(cell_.corner[0]));
      }
    }
    if constexpr (!encoding) cell.number[i] = damaged_ ? 0 : number_of(node_[i]);
  }
}

// Ends of points.

/// Which nodes are used for the last time. `corners_too`: where a pattern has told the ends of corners, only
/// nodes behind them are asked about.
template <class Coder>
void CellCoder<Coder>::code_finals(Coder& coder, StreamedCell& cell, bool corners_too) {
  const CellShape& shape = cell_.shape();
  uint32_t final = corners_too ? 0 : cell.final & ((1u << shape.corners) - 1);
  for (unsigned i = corners_too ? 0 : shape.corners; i < shape.nodes; ++i) {
    bool before = false;
    for (unsigned j = 0; j < i && !before; ++j) before = node_[j] == node_[i];
    // A node that repeats an earlier one ends with it.
    if (before) continue;
    const Hull::Point& point = hull_.point(node_[i]);
    uint32_t local = std::min<uint32_t>(point.valence(), 63) | std::min<uint32_t>(point.open(), 31) << 6 |
                     cell_.kind << 11;
    if (i >= shape.corners) {
      // A node on an edge mostly ends when both ends of the edge do; that was coded before.
      const bool with_corners = (shape.lies_on[i] & ~final) == 0;
      local = i | (with_corners ? 32u : 0) | cell_.kind << 11 | 0x100000;
    }
    const bool fresh = i < shape.corners && cell_.is_fresh(i);
    const uint32_t nearby = i | (fresh ? 32u : 0) | (last_signature_ & 0xffff) << 6;
    if (decide(coder, (cell.final >> i & 1) != 0, is_final, local, nearby, local * 32 + i)) final |= 1u << i;
  }
  cell.final = final;
}

/// The group follows cells that come around point after point, as many generators write them. It stays as
/// long as the cell has its point.
template <class Coder>
void CellCoder<Coder>::follow_group() {
  uint64_t least = ~uint64_t{0};
  bool next = false;
  for (unsigned i = 0; i < cell_.shape().corners; ++i) {
    const uint64_t number = number_of(node_[i]);
    if (number == group_) return;
    next = next || number == group_ + 1;
    least = std::min(least, number);
  }
  group_ = next ? group_ + 1 : least;
}

/// A cell without known shape: a list of points, each new or named by its number. It is in no list of the
/// hull, so nothing is ever glued to it; it takes no slot, and its neighbours are none.
template <class Coder>
bool CellCoder<Coder>::code_loose(Coder& coder, Coder& numbers, StreamedCell& cell, CodedCells& out) {
  const auto type = static_cast<uint8_t>(coder.code_raw(static_cast<uint32_t>(cell.type), 8));
  const int64_t count = loose_count_.code(coder, static_cast<int64_t>(cell.numbers.size()));
  // most_loose_nodes bounds what one record may claim. Nothing is reserved for it: vectors grow with what was
  // decoded.
  damaged_ = damaged_ || count < 0 || count > most_loose_nodes || exceeds(static_cast<uint64_t>(count));
  cell.kind = loose_cell;
  cell.type = static_cast<CellType>(type);
  out.kinds.push_back(loose_cell);
  out.loose_types.push_back(cell.type);
  out.begin.push_back(static_cast<uint32_t>(out.nodes.size()));
  out.cell_slots.push_back(no_slot);
  out.across.emplace_back().fill(no_slot);
  if constexpr (!encoding) {
    cell.numbers.clear();
    cell.finals.clear();
  }
  const size_t first = out.nodes.size();
  for (int64_t i = 0; i < count && !damaged_; ++i) {
    uint64_t number = encoding ? cell.numbers[static_cast<size_t>(i)] : 0;
    uint32_t slot = encoding ? slot_of_input(number, 16) : no_slot;
    if (decide(coder, slot == no_slot, is_new, 0x20000, 0, 0)) {
      NewPoint point;
      point.slot = slot = create_point(numbers, number, false, 0, 63);
      if (damaged_) break;
      point.number = encoding ? number : number_of(slot);
      out.points.push_back(point);
    } else {
      slot = code_old_point(coder, slot, last_loose_);
      if (damaged_) break;
    }
    last_loose_ = number_of(slot);
    out.nodes.push_back(slot);
    // The loop is bounded by the stream: every node costs at least one decision, 2^-11 bit.
    damaged_ = !encoding && coder.exhausted();
    if constexpr (!encoding) cell.numbers.push_back(last_loose_);
  }
  // By now all points have slots, so that ends can be coded after all of them; a point listed twice may end
  // once only.
  for (size_t i = 0; i < static_cast<size_t>(count) && !damaged_; ++i) {
    bool final = encoding && cell.finals[i] != 0;
    final = decide(coder, final, is_final, 0x200000, 0, 0);
    if constexpr (!encoding) cell.finals.push_back(final);
    const uint32_t slot = out.nodes[first + i];
    if (final && hull_.point(slot).alive()) end_point(slot, out);
  }
  last_kind_ = loose_cell;
  return !damaged_;
}

template void CellCoder<RangeEncoder>::code_corners(RangeEncoder&);
template void CellCoder<RangeEncoder>::fill_table();
template void CellCoder<RangeEncoder>::glue_the_rest();
template uint32_t CellCoder<RangeEncoder>::code_old_point(RangeEncoder&, uint32_t, uint64_t);
template void CellCoder<RangeEncoder>::code_extra_nodes(RangeEncoder&, RangeEncoder&, StreamedCell&,
                                                        CodedCells&);
template void CellCoder<RangeEncoder>::code_finals(RangeEncoder&, StreamedCell&, bool);
template void CellCoder<RangeEncoder>::follow_group();
template bool CellCoder<RangeEncoder>::code_loose(RangeEncoder&, RangeEncoder&, StreamedCell&, CodedCells&);
template void CellCoder<RangeDecoder>::code_corners(RangeDecoder&);
template void CellCoder<RangeDecoder>::fill_table();
template void CellCoder<RangeDecoder>::glue_the_rest();
template uint32_t CellCoder<RangeDecoder>::code_old_point(RangeDecoder&, uint32_t, uint64_t);
template void CellCoder<RangeDecoder>::code_extra_nodes(RangeDecoder&, RangeDecoder&, StreamedCell&,
                                                        CodedCells&);
template void CellCoder<RangeDecoder>::code_finals(RangeDecoder&, StreamedCell&, bool);
template void CellCoder<RangeDecoder>::follow_group();
template bool CellCoder<RangeDecoder>::code_loose(RangeDecoder&, RangeDecoder&, StreamedCell&, CodedCells&);

}  // namespace maille
