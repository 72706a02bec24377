// The slow path: cells that no pattern fits, in the order in which docs/format.md, 16.6, has the steps.
#include <algorithm>

#include "volume/cells/cell_coder.h"

namespace maille {
namespace {

/// Turns are written as own face * 8 + mirrored * 4 + rotation.
constexpr unsigned face_of_turn(unsigned turn) {
  return turn / 8;
}

/// Corner of the own face that lies on corner `i` of the other. `i` is below `size`, so the difference does
/// not wrap.
unsigned own_corner(const CellFace& own, unsigned turn, unsigned i) {
  const unsigned size = own.size, rotation = turn % 4;
  const bool mirrored = (turn / 4) % 2 != 0;
  return own.corner[(mirrored ? rotation + size - i : rotation + i) % size];
}

/// Whether a turn that was decoded exists: its face must be of the cell and as large as the anchor's face;
/// three corners have three rotations; one or two corners have no mirror image of their own.
bool is_turn(const CellShape& shape, unsigned size, unsigned turn) {
  const unsigned face = face_of_turn(turn);
  if (face >= shape.faces || shape.face[face].size != size || turn % 4 >= size) return false;
  return (turn / 4) % 2 == 0 || size > 2;
}

}  // namespace

/// Codes the kind and, of those with a shape, how the cell is joined to memory. `cell` is read by an encoder
/// only.
template <class Coder>
void CellCoder<Coder>::code_slowly(Coder& coder, StreamedCell& cell) {
  const unsigned kind = code_kind(coder, cell.kind);
  cell_.kind = kind;
  cell_.known = cell_.fresh = cell_.glued = 0;
  if (!damaged_ && kind < shape_count) join_slowly(coder, cell);
}

/// Joins a cell whose kind is known. Each step looks only at what the steps before made known, so that a
/// decoder can follow. A step that finds the stream damaged leaves the cell unfinished; code() then returns
/// false.
template <class Coder>
void CellCoder<Coder>::join_slowly(Coder& coder, const StreamedCell& cell) {
  if constexpr (encoding) {
    find_targets(cell);
    find_partners();
  }
  const FaceRef anchor = code_anchor(coder);
  if (damaged_) return;
  if (anchor.cell != no_slot) code_turn(coder, anchor);
  if (!damaged_) code_corners(coder);
  if (!damaged_) glue_the_rest();
}

/// A mesh mostly goes on with the same kind; else five bits tell one of kind_count = 22, and larger values
/// are damage.
template <class Coder>
unsigned CellCoder<Coder>::code_kind(Coder& coder, unsigned kind) {
  if (decide(coder, kind == last_kind_, same_kind, last_kind_, 0, 0)) return last_kind_;
  unsigned node = 1;
  for (unsigned level = 0; level < 5; ++level) {
    const bool bit = (kind >> (4 - level) & 1) != 0;
    node = node * 2 + decide(coder, bit, kind_bit, last_kind_ * 32 + node, 0, 0);
  }
  damaged_ = damaged_ || node - 32 >= kind_count;
  return node - 32;
}

/// Encoder: the slot of each corner, or no_slot for points that are not in memory, which are new.
template <class Coder>
void CellCoder<Coder>::find_targets(const StreamedCell& cell) {
  for (unsigned i = 0; i < cell_.shape().corners; ++i) target_[i] = slot_of_input(cell.number[i], i);
}

/// Encoder: the cells that have an open face which is a face of this one. They are sought around as few
/// corners as have all faces.
template <class Coder>
void CellCoder<Coder>::find_partners() {
  partner_count_ = 0;
  const CellShape& shape = cell_.shape();
  unsigned left = (1u << shape.faces) - 1;
  for (unsigned f = 0; f < shape.faces; ++f) {
    // A face found around one corner would be found around any other of its corners as well, so all faces at
    // the chosen corner are done with.
    if ((left >> f & 1) == 0) continue;
    unsigned from = most_corners;
    bool all_there = true;
    for (unsigned i = 0; i < shape.face[f].size; ++i) {
      const unsigned corner = shape.face[f].corner[i];
      all_there = all_there && target_[corner] != no_slot;
      if (!all_there) break;
      // The corner with the shortest list.
      if (from == most_corners ||
          hull_.point(target_[corner]).valence() < hull_.point(target_[from]).valence())
        from = corner;
    }
    left &= ~(1u << f);
    if (!all_there) continue;
    left &= ~static_cast<unsigned>(shape.faces_at[from]);
    if (hull_.point(target_[from]).open() == 0) continue;
    // More than there is room for are no mesh, and any of them will do.
    hull_.around(target_[from], [&](uint32_t slot, uint32_t corner) {
      add_partner(slot, hull_.cell(slot).open & Hull::shape_of(hull_.cell(slot)).faces_at[corner]);
      return partner_count_ == partners_.size();
    });
  }
}

/// Encoder: notes the cell if one of `faces` of it is a face of this cell, with the corners in some order
/// that a turn can say.
template <class Coder>
void CellCoder<Coder>::add_partner(uint32_t slot, unsigned faces) {
  const Hull::Cell& other = hull_.cell(slot);
  const CellShape& shape = cell_.shape();
  for (; faces != 0 && partner_count_ < partners_.size(); faces &= faces - 1) {
    const auto face = static_cast<unsigned>(__builtin_ctz(faces));
    const CellFace& there = Hull::shape_of(other).face[face];
    bool has_all = true;
    for (unsigned i = 0; i < there.size && has_all; ++i) {
      const auto end = target_.begin() + shape.corners;
      has_all = std::find(target_.begin(), end, other.corner[there.corner[i]]) != end;
    }
    if (!has_all || is_partner(slot) || match(other, face, no_turn) == no_turn) continue;
    partners_[partner_count_++] = slot;
    return;
  }
}

template <class Coder>
bool CellCoder<Coder>::is_partner(uint32_t slot) const {
  const auto end = partners_.begin() + partner_count_;
  return std::find(partners_.begin(), end, slot) != end;
}

// Anchor: a cell in memory with an open face that is a face of this one.

/// A candidate that is marked, closed or of another dimension is passed over without a rank: ranks count only
/// those that are asked about. Marks are cleared in code_anchor().
template <class Coder>
void CellCoder<Coder>::add_anchor(uint32_t cell, unsigned origin) {
  Hull::Cell& candidate = hull_.cell(cell);
  if (candidate.mark != 0 || candidate.open == 0 || anchor_count_ == anchors_.size()) return;
  if (Hull::shape_of(candidate).dimension != cell_.shape().dimension) return;
  candidate.mark = 1;
  anchors_[anchor_count_++] = {cell, static_cast<uint8_t>(origin), origin_ranks_[origin]++};
}

/// Cells around the point with this number, if it is in memory: twelve are enough for a point where few cells
/// meet, and bound the work elsewhere. (Chosen, no sweep is on record; it is part of the format.)
template <class Coder>
void CellCoder<Coder>::add_anchors_around(uint64_t number, unsigned origin) {
  const uint32_t slot = slot_of(number, 9 + origin);
  if (slot == no_slot) return;
  unsigned left = 12;
  hull_.around(slot, [&](uint32_t cell, uint32_t) {
    add_anchor(cell, origin);
    return --left == 0;
  });
}

/// The next candidates, some more far-fetched each time: the last cell and those after its neighbours, the
/// newest first; the last anchor and those after it; those around the group's point and the next one; those
/// that share a point with the last cell, the newest first; the last sixteen. False when there are no more.
/// Most anchors are among the first, so that the others are hardly ever looked for.
template <class Coder>
bool CellCoder<Coder>::collect_anchors(unsigned round) {
  switch (round) {
    case 0:
      add_anchors_ahead();
      return true;
    case 1:
      add_anchors_after();
      return true;
    case 2:
      add_anchors_around(group_, 2);
      add_anchors_around(group_ + 1, 3);
      return true;
    case 3:
      add_anchors_beside();
      return true;
    case 4:
      for (unsigned i = 0; i < recent_cells_.size(); ++i) {
        const CellRef& ref = recent_cells_[(ordinal_ - 1 - i) % recent_cells_.size()];
        if (hull_.valid(ref)) add_anchor(ref.slot, 5);
      }
      return true;
    default:
      return false;
  }
}

/// Origins 0 and 1. Seven entries are sorted by insertion; the key holds age and slot, so that the order is
/// total.
template <class Coder>
void CellCoder<Coder>::add_anchors_ahead() {
  if (sources_.cell[0] != no_slot) add_anchor(sources_.cell[0], 0);
  // By age, then slot: in one number.
  std::array<uint64_t, source_count> found;
  unsigned count = 0;
  for (unsigned f = 1; f < source_count; ++f) {
    if (sources_.cell[f] == no_slot) continue;
    const uint64_t key = age_and_slot(sources_.cell[f]);
    unsigned at = count++;
    for (; at > 0 && found[at - 1] > key; --at) found[at] = found[at - 1];
    found[at] = key;
  }
  for (unsigned i = 0; i < count; ++i) add_anchor(static_cast<uint32_t>(found[i]), 1);
}

/// Origin 6: a run of cells along an earlier run. Twelve steps; each reference is checked by ordinal, as the
/// cells may have left.
template <class Coder>
void CellCoder<Coder>::add_anchors_after() {
  uint32_t next = hull_.valid(last_anchor_) ? last_anchor_.slot : no_slot;
  for (unsigned i = 0; i < 12 && next != no_slot; ++i) {
    add_anchor(next, 6);
    const uint32_t ordinal = hull_.cell(next).ordinal;
    const CellRef after = {hull_.cell(next).successor, ordinal + 1};
    next = hull_.valid(after) ? after.slot : no_slot;
  }
}

/// Origin 4. At most 24 cells around each of eight corners, 96 in all, of which the newest 24 become
/// candidates. The second bit of `mark` keeps a cell from being collected twice, without touching the first,
/// which says that it is a candidate already.
template <class Coder>
void CellCoder<Coder>::add_anchors_beside() {
  std::array<uint64_t, 96> found;
  unsigned count = 0;
  for (unsigned i = 0; i < most_corners && sources_.cell[0] != no_slot; ++i) {
    const uint32_t point = hull_.cell(sources_.cell[0]).corner[i];
    if (point == no_slot || hull_.point(point).open() == 0) continue;
    unsigned left = 24;
    hull_.around(point, [&](uint32_t slot, uint32_t) {
      Hull::Cell& cell = hull_.cell(slot);
      if (cell.open != 0 && (cell.mark & 2) == 0 && count < found.size()) {
        cell.mark |= 2;
        found[count++] = age_and_slot(slot);
      }
      return --left == 0;
    });
  }
  for (unsigned i = 0; i < count; ++i) hull_.cell(static_cast<uint32_t>(found[i])).mark &= 1;
  const unsigned newest = std::min(count, 24u);
  // Keys differ, as each has its own slot, so that which 24 are taken does not depend on the library's sort.
  std::partial_sort(found.begin(), found.begin() + newest, found.begin() + count);
  for (unsigned i = 0; i < newest; ++i) add_anchor(static_cast<uint32_t>(found[i]), 4);
}

/// Encoder: whether own corners in this turn are the corners of the face in memory.
template <class Coder>
bool CellCoder<Coder>::matches_turn(const Hull::Cell& other, unsigned face, Turn turn) const {
  const CellFace& there = Hull::shape_of(other).face[face];
  if (!is_turn(cell_.shape(), there.size, turn)) return false;
  const CellFace& own = cell_.shape().face[face_of_turn(turn)];
  for (unsigned i = 0; i < there.size; ++i) {
    if (target_[own_corner(own, turn, i)] != other.corner[there.corner[i]]) return false;
  }
  return true;
}

/// Encoder: the turn with which the cell lies on the face; the preferred one if it fits, as it is cheapest,
/// else the lowest. A cell that repeats corners may fit in several ways.
template <class Coder>
typename CellCoder<Coder>::Turn CellCoder<Coder>::match(const Hull::Cell& other, unsigned face,
                                                        Turn preferred) const {
  if (matches_turn(other, face, preferred)) return preferred;
  const CellFace& there = Hull::shape_of(other).face[face];
  const CellShape& shape = cell_.shape();
  unsigned there_too = 0;  // own corners at the first corner of that face
  for (unsigned i = 0; i < shape.corners; ++i) {
    if (target_[i] == other.corner[there.corner[0]]) there_too |= 1u << i;
  }
  if (there_too == 0) return no_turn;
  for (Turn turn = 0; turn < 8u * shape.faces; ++turn) {
    const CellFace& own = shape.face[face_of_turn(turn)];
    if (turn % 4 >= own.size || (there_too >> own.corner[turn % 4] & 1) == 0) continue;
    if (matches_turn(other, face, turn)) return turn;
  }
  return no_turn;
}

/// Which of the candidates is the anchor. They are collected lazily: the encoder as far as the first partner,
/// the decoder as far as the answers go. Both ask about the same ones in the same order, since a round only
/// ever appends.
template <class Coder>
FaceRef CellCoder<Coder>::code_anchor(Coder& coder) {
  if (cell_.shape().dimension == 0) return {};
  anchor_count_ = 0;
  origin_ranks_ = {};
  unsigned round = 0, chosen = 0;
  bool listed = encoding && partner_count_ > 0;
  const auto is_there = [&](unsigned i) {
    while (i == anchor_count_ && collect_anchors(round)) ++round;
    return i < anchor_count_;
  };
  if (listed) {
    while (is_there(chosen) && !is_partner(anchors_[chosen].cell)) ++chosen;
    listed = chosen < anchor_count_;
  }
  // Asked first: a mesh in no order does not take fifty decisions a cell then, nor are candidates collected.
  const uint32_t beside = sources_.cell[0] == no_slot ? 0 : hull_.cell(sources_.cell[0]).open + 1u;
  listed = decide(coder, listed, anchor_listed, cell_.kind << 1, last_choice_, beside);
  uint32_t found = no_slot;
  for (unsigned i = 0; listed && found == no_slot; ++i) {
    // More answers "no" than there are candidates: only a damaged stream says so.
    if (!encoding && !is_there(i)) {
      damaged_ = true;
      break;
    }
    const Candidate& candidate = anchors_[i];
    const Hull::Cell& other = hull_.cell(candidate.cell);
    const uint32_t rank = candidate.origin * 8u + std::min<uint32_t>(candidate.rank, 7);
    const uint32_t local = candidate.origin | std::min<uint32_t>(candidate.rank, 7) << 3 |
                           bits_in(other.open) << 6 | cell_.kind << 9;
    const uint32_t choice = last_choice_ * 64 + rank;
    if (!decide(coder, i == chosen, anchor_here, local, other.signature, choice * 64 + other.open)) continue;
    last_choice_ = rank;
    found = candidate.cell;
  }
  // Both sides have marked different numbers of candidates; clearing all leaves the hull the same.
  for (unsigned i = 0; i < anchor_count_; ++i) hull_.cell(anchors_[i].cell).mark = 0;
  if (found != no_slot) return code_face_of(coder, found);
  last_choice_ = 63;
  anchor_signature_ = 0;
  return damaged_ ? FaceRef{} : code_distant_anchor(coder);
}

/// The signature of the anchor is evidence for all that follows in this cell.
template <class Coder>
FaceRef CellCoder<Coder>::code_face_of(Coder& coder, uint32_t anchor) {
  anchor_signature_ = hull_.cell(anchor).signature;
  last_anchor_ = {anchor, hull_.cell(anchor).ordinal};
  return {anchor, code_face(coder, anchor)};
}

/// An anchor that is not among the candidates: the number of one of its points, then which of the cells
/// there.
template <class Coder>
FaceRef CellCoder<Coder>::code_distant_anchor(Coder& coder) {
  uint32_t point = no_slot, anchor = no_slot;
  if constexpr (encoding) {
    for (unsigned i = 0; i < cell_.shape().corners && anchor == no_slot && partner_count_ > 0; ++i) {
      // A cell with an open face of this cell is in the list of one of its points, unless more than 64 cells
      // are around each. Then the cell has no anchor and its corners are named one by one.
      if (target_[i] == no_slot) continue;
      hull_.around(target_[i], [&](uint32_t cell, uint32_t) {
        if (!is_partner(cell)) return false;
        point = target_[i];
        anchor = cell;
        return true;
      });
    }
  }
  if (!decide(coder, anchor != no_slot, any_anchor, cell_.kind, 0, 0)) return {};
  point = code_old_point(coder, point, group_);
  if (damaged_) return {};
  uint32_t found = no_slot;
  unsigned rank = 0;
  hull_.around(point, [&](uint32_t cell, uint32_t) {
    const Hull::Cell& other = hull_.cell(cell);
    if (other.open == 0 || Hull::shape_of(other).dimension != cell_.shape().dimension) return false;
    const bool here = decide(coder, cell == anchor, which_cell, std::min<uint32_t>(rank++, 15),
                             other.signature, other.open);
    if (here) found = cell;
    return here;
  });
  // A decoder was told that there is an anchor here, and there is none.
  if (found == no_slot) {
    damaged_ = true;
    return {};
  }
  return code_face_of(coder, found);
}

/// Which of the open faces: the one used last time is asked first, the last one left is not asked.
template <class Coder>
uint32_t CellCoder<Coder>::code_face(Coder& coder, uint32_t anchor) {
  const Hull::Cell& other = hull_.cell(anchor);
  // `other.open` is not 0, as candidates and distant anchors have open faces, so that the loop ends with the
  // last one.
  unsigned open = other.open;
  for (unsigned rank = 0;; ++rank) {
    const unsigned face =
        (open >> last_face_ & 1) != 0 ? last_face_ : static_cast<unsigned>(__builtin_ctz(open));
    bool here = (open & (open - 1)) == 0;
    if (!here) {
      if constexpr (encoding) here = match(other, face, no_turn) != no_turn;
      const uint32_t local = face | rank << 3 | (face == last_face_ ? 64u : 0) | other.kind * 128u;
      here = decide(coder, here, face_here, local, other.signature, other.open | last_choice_ << 8);
    }
    if (here) return last_face_ = face;
    open &= ~(1u << face);
  }
}

/// How the cell lies on the anchor's face, then what of it follows. A turn has six bits: face (3), mirrored
/// (1), rotation (2). Some of these do not exist for the kind at hand, which is_turn() refuses.
template <class Coder>
void CellCoder<Coder>::code_turn(Coder& coder, FaceRef anchor) {
  const Hull::Cell& other = hull_.cell(anchor.cell);
  const unsigned size = Hull::shape_of(other).face[anchor.face].size;
  uint8_t& last = last_turn_[other.kind][anchor.face][cell_.kind];
  Turn turn = last;
  if constexpr (encoding) turn = match(other, anchor.face, last);
  const uint32_t local = anchor.face | cell_.kind << 3 | static_cast<uint32_t>(other.kind) << 8;
  if (decide(coder, turn == last, same_turn, local, other.signature, last_choice_)) {
    turn = last;
  } else {
    unsigned node = 1;
    for (unsigned level = 0; level < 6; ++level) {
      const bool bit = (turn >> (5 - level) & 1) != 0;
      node = node * 2 +
             decide(coder, bit, turn_bit, local << 6 | node, other.signature, last_choice_ * 64u + node);
    }
    turn = node - 64;
  }
  damaged_ = damaged_ || !is_turn(cell_.shape(), size, turn);
  if (damaged_) return;
  last = static_cast<uint8_t>(turn);
  place(anchor, turn);
  if (cell_.shape().dimension == 3) code_edges(coder, anchor, face_of_turn(turn));
  if (cell_.shape().dimension == 2) code_faces_below(coder, anchor);
}

/// The corners of the anchor's face become known, and the two faces are glued.
template <class Coder>
void CellCoder<Coder>::place(FaceRef anchor, Turn turn) {
  const Hull::Cell& other = hull_.cell(anchor.cell);
  const CellFace& there = Hull::shape_of(other).face[anchor.face];
  const CellFace& own = cell_.shape().face[face_of_turn(turn)];
  for (unsigned i = 0; i < there.size; ++i) {
    cell_.set_corner(own_corner(own, turn, i), other.corner[there.corner[i]]);
  }
  cell_.set_glue(face_of_turn(turn), anchor);
}

// Edges of the anchor face: is the cell glued to one of the open faces that meet there too?

/// Lays an open face over own face `own`, edge on edge. False if they differ in size or contradict what is
/// known.
template <class Coder>
bool CellCoder<Coder>::lay_over(const Hull::Cell& other, unsigned face, unsigned own, unsigned a, unsigned b,
                                EdgeFace& found) const {
  const CellFace& there = Hull::shape_of(other).face[face];
  const CellFace& here = cell_.shape().face[own];
  const unsigned size = here.size;
  if (there.size != size) return false;
  // The place of a corner in a cycle; `size` if it is not there, as may be in cells that repeat corners.
  const auto place_there = [&](unsigned corner) {
    unsigned i = 0;
    while (i < size && other.corner[there.corner[i]] != cell_.corner[corner]) ++i;
    return i;
  };
  const auto place_here = [&](unsigned corner) {
    unsigned i = 0;
    while (i < size && here.corner[i] != corner) ++i;
    return i;
  };
  const unsigned there_a = place_there(a), there_b = place_there(b), here_a = place_here(a),
                 here_b = place_here(b);
  if (there_a == size || there_b == size || here_a == size || here_b == size) return false;
  // The direction in which the cycle goes from a to b. The edge is one of the face, so it is a step forwards
  // or backwards.
  const unsigned step_there = (there_a + 1) % size == there_b ? 1 : size - 1;
  const unsigned step_here = (here_a + 1) % size == here_b ? 1 : size - 1;
  for (unsigned i = 0; i < size; ++i) {
    const unsigned corner = here.corner[(here_a + step_here * i) % size];
    const uint32_t slot = other.corner[there.corner[(there_a + step_there * i) % size]];
    // Something known contradicts: the face is another one, and no decision is spent on it.
    if (cell_.has(corner) && cell_.corner[corner] != slot) return false;
    found.slot[(here_a + step_here * i) % size] = slot;
  }
  return true;
}

/// Fills edge_faces_ with the open faces at the edge that could be own face `own`, eight at most; returns how
/// many cells have the edge. The walk starts from the end with the shorter list; a tie takes `a`, so that
/// both sides see the faces in the same order.
template <class Coder>
unsigned CellCoder<Coder>::faces_at_edge(uint32_t anchor, unsigned own, unsigned a, unsigned b) {
  edge_face_count_ = 0;
  unsigned cells = 0;
  uint32_t from = cell_.corner[a], to = cell_.corner[b];
  if (hull_.point(from).valence() > hull_.point(to).valence()) std::swap(from, to);
  hull_.around(from, [&](uint32_t slot, uint32_t corner) {
    const Hull::Cell& other = hull_.cell(slot);
    const CellShape& shape = Hull::shape_of(other);
    if (shape.dimension != 3) return false;
    for (unsigned n = shape.neighbours[corner]; n != 0; n &= n - 1) {
      const auto end = static_cast<unsigned>(__builtin_ctz(n));
      if (other.corner[end] != to) continue;
      ++cells;
      for (unsigned f = other.open & shape.faces_at[corner] & shape.faces_at[end]; f != 0 && slot != anchor;
           f &= f - 1) {
        if (edge_face_count_ == edge_faces_.size()) return true;
        EdgeFace& face = edge_faces_[edge_face_count_];
        face.face = {slot, static_cast<uint32_t>(__builtin_ctz(f))};
        edge_face_count_ += lay_over(other, face.face.face, own, a, b, face);
      }
    }
    return false;
  });
  return cells;
}

/// For each edge of the anchor's face: is the own face across it glued to one of the open faces there? In a
/// structured front the answer follows from how many cells the edge has, which leads the context.
template <class Coder>
void CellCoder<Coder>::code_edges(Coder& coder, FaceRef anchor, unsigned own_face) {
  const CellFace& base = cell_.shape().face[own_face];
  uint32_t glued_so_far = 0;
  for (unsigned i = 0; i < base.size; ++i) {
    const unsigned own = base.across[i], a = base.corner[i], b = base.corner[(i + 1u) % base.size];
    const CellFace& face = cell_.shape().face[own];
    if (cell_.is_glued(own)) continue;
    const unsigned cells = std::min<uint32_t>(faces_at_edge(anchor.cell, own, a, b), 15);
    std::array<uint32_t, 4> slots{};
    const unsigned known = cell_.known_of(face, slots);
    bool glued = false;
    for (unsigned k = 0; k < edge_face_count_ && !glued; ++k) {
      const EdgeFace& candidate = edge_faces_[k];
      if constexpr (encoding) {
        glued = true;
        for (unsigned c = 0; c < face.size; ++c)
          glued = glued && target_[face.corner[c]] == candidate.slot[c];
      }
      const Hull::Cell& other = hull_.cell(candidate.face.cell);
      const uint32_t local = cells | (known - 2) << 4 | std::min<uint32_t>(edge_face_count_, 3) << 6 |
                             // Fields are packed without overlap: cells 4 bits, known corners 2, candidates
                             // 2, glued edges 4, edge 2, candidate 2, kind above. Candidates are laid on two
                             // known corners at least, so that known - 2 does not wrap.
                             glued_so_far << 8 | i << 12 | std::min<uint32_t>(k, 3) << 14 | cell_.kind << 16;
      const uint32_t valence =
          hull_.point(cell_.corner[a]).valence() * 32u + hull_.point(cell_.corner[b]).valence();
      glued = decide(coder, glued, glued_here, local, hashed(anchor_signature_, other.signature),
                     valence * 16 + cells);
      if (!glued) continue;
      for (unsigned c = 0; c < face.size; ++c) cell_.set_corner(face.corner[c], candidate.slot[c]);
      cell_.set_glue(own, candidate.face);
    }
    glued_so_far |= (glued ? 1u : 0u) << i;
  }
}

/// A polygon next to solids mostly lies on the open face at its first edge where its neighbour does not lie.
/// All its corners then follow from one decision. A face that shares all its corners with the neighbour is
/// the one on which the neighbour lies.
template <class Coder>
void CellCoder<Coder>::code_faces_below(Coder& coder, FaceRef anchor) {
  const CellShape& shape = cell_.shape();
  const Hull::Cell& neighbour = hull_.cell(anchor.cell);
  const unsigned own = static_cast<unsigned>(__builtin_ctz(cell_.glued));
  const unsigned a = shape.face[own].corner[0], b = shape.face[own].corner[1];
  unsigned tried = 0;
  hull_.around(cell_.corner[a], [&](uint32_t slot, uint32_t corner) {
    const Hull::Cell& solid = hull_.cell(slot);
    const CellShape& solid_shape = Hull::shape_of(solid);
    if (solid_shape.dimension != 3) return false;
    for (unsigned f = solid.open & solid_shape.faces_at[corner]; f != 0; f &= f - 1) {
      const CellFace& face = solid_shape.face[static_cast<unsigned>(__builtin_ctz(f))];
      if (face.size != shape.corners) continue;
      unsigned at_a = 4, at_b = 4, shared = 0;
      for (unsigned i = 0; i < face.size; ++i) {
        const uint32_t point = solid.corner[face.corner[i]];
        if (point == cell_.corner[a]) at_a = i;
        if (point == cell_.corner[b]) at_b = i;
        for (unsigned j = 0; j < Hull::shape_of(neighbour).corners; ++j)
          shared += neighbour.corner[j] == point;
      }
      if (at_a == 4 || at_b == 4 || shared >= face.size) continue;
      const unsigned size = face.size, step = (at_a + 1) % size == at_b ? 1 : size - 1;
      const unsigned own_step = (a + 1) % size == b ? 1 : size - 1;
      bool here = encoding;
      for (unsigned i = 0; i < size && encoding; ++i) {
        here =
            here && target_[(a + own_step * i) % size] == solid.corner[face.corner[(at_a + step * i) % size]];
      }
      here = decide(coder, here, over_face, std::min<uint32_t>(tried++, 3), solid.signature, 0);
      for (unsigned i = 0; i < size && here; ++i) {
        cell_.set_corner((a + own_step * i) % size, solid.corner[face.corner[(at_a + step * i) % size]]);
      }
      // Nine questions at most, as docs/format.md, 16.6, step 5 says: the bound on work at a point where
      // thousands of solids meet.
      if (here || tried > 8) return true;
    }
    return false;
  });
}

template void CellCoder<RangeEncoder>::code_slowly(RangeEncoder&, StreamedCell&);
template unsigned CellCoder<RangeEncoder>::code_kind(RangeEncoder&, unsigned);
template void CellCoder<RangeEncoder>::join_slowly(RangeEncoder&, const StreamedCell&);
template void CellCoder<RangeEncoder>::find_targets(const StreamedCell&);
template bool CellCoder<RangeEncoder>::matches_turn(const Hull::Cell&, unsigned, unsigned) const;
template void CellCoder<RangeEncoder>::place(FaceRef, unsigned);
template void CellCoder<RangeEncoder>::code_faces_below(RangeEncoder&, FaceRef);
template void CellCoder<RangeDecoder>::code_slowly(RangeDecoder&, StreamedCell&);
template unsigned CellCoder<RangeDecoder>::code_kind(RangeDecoder&, unsigned);
template void CellCoder<RangeDecoder>::join_slowly(RangeDecoder&, const StreamedCell&);
template void CellCoder<RangeDecoder>::find_targets(const StreamedCell&);
template bool CellCoder<RangeDecoder>::matches_turn(const Hull::Cell&, unsigned, unsigned) const;
template void CellCoder<RangeDecoder>::place(FaceRef, unsigned);
template void CellCoder<RangeDecoder>::code_faces_below(RangeDecoder&, FaceRef);

}  // namespace maille
