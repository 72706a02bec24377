// Cells in an order that the encoder may choose: each comes at the first gate (gates.h), so that only its
// turn there, the faces that it meets beside it, and its new corners are told. What is rare goes the slow
// way.
#include <algorithm>

#include "volume/cells/cell_coder.h"

namespace maille {
namespace {

// How many gates a cell may pass over: gates that wait for nothing (where a mesh is not closed as expected)
// are given up one by one. Part of the format, as is the next one (docs/format.md, 16.13).
constexpr unsigned most_skipped = 64;
// A walk around an edge ends after 63 cells at the latest, whatever a damaged stream has glued to what.
constexpr unsigned most_around_edge = 64;

/// The own face at whose corner `rotation` the other's first corner lies, as a turn.
unsigned turn_of(unsigned face, bool mirrored, unsigned rotation) {
  return face * 8 + (mirrored ? 4u : 0) + rotation;
}

/// In the face beyond edge i of another one: the corners that come next to the ends of the edge. In a
/// triangle both are the same corner.
struct Beyond {
  uint8_t next_to_a, next_to_b;
};
Beyond find_beyond(const CellShape& shape, const CellFace& base, unsigned i) {
  const unsigned a = base.corner[i], b = base.corner[i + 1u < base.size ? i + 1 : 0];
  const auto& beside = shape.beside[base.across[i]];
  return {beside[a].before == b ? beside[a].after : beside[a].before,
          beside[b].before == a ? beside[b].after : beside[b].before};
}

/// By kind and face: at each edge. A table, because this is asked for each edge of each cell; made on first
/// use, which C++ makes safe for threads.
using BeyondEdges = std::array<std::array<std::array<Beyond, 4>, most_faces>, shape_count>;
const BeyondEdges& beyond_edges() {
  static const BeyondEdges table = [] {
    BeyondEdges found{};
    for (unsigned kind = 0; kind < shape_count; ++kind) {
      const CellShape& shape = cell_shapes[kind];
      for (unsigned f = 0; f < shape.faces && shape.dimension == 3; ++f) {
        for (unsigned i = 0; i < shape.face[f].size; ++i)
          found[kind][f][i] = find_beyond(shape, shape.face[f], i);
      }
    }
    return found;
  }();
  return table;
}

}  // namespace

/// One cell, as docs/format.md, 16.13, has the steps. Patterns and sources in the sense of find_sources() are
/// not used: at gates the place of the cell follows from the gate.
template <class Coder>
bool CellCoder<Coder>::code_by_gates(Coder& topology, Coder& numbers, StreamedCell& cell, CodedCells& out) {
  signature_ = anchor_signature_ = 0;
  cell_.known = cell_.fresh = cell_.glued = 0;
  bool at_gate = false;
  entered_by_ = 7;
  const bool gated = code_gate(topology, cell, at_gate);
  if (damaged_) return false;
  if (cell_.kind >= shape_count) return code_without_shape(topology, numbers, cell, out);
  if (!gated) {
    find_sources();
    join_slowly(topology, cell);
  } else {
    // A cell at no gate has no neighbour to expect numbers from.
    if (!at_gate) sources_.cell.fill(no_slot);
    const unsigned known = cell_.known;
    if (!damaged_) code_corners(topology);
    // A corner that was named may be anywhere: faces that close there need not be near the edges of the gate,
    // so only the search of glue_the_rest() finds them.
    const bool beside = cell_.known == known && cell_.shape().dimension == 3;
    if (!damaged_ && beside) glue_beside();
    if (!damaged_ && !beside) glue_the_rest();
  }
  if (damaged_) return false;
  cell.kind = cell_.kind;
  create_corners(numbers, cell, out);
  if (cell_.shape().nodes > cell_.shape().corners) code_extra_nodes(topology, numbers, cell, out);
  if (damaged_) return false;
  const unsigned gates = gated ? code_borders(topology) : 0;
  enter(out);
  gates_->enter(hull_, last_.slot, cell_.glue, gated ? cell_.glued : 0, gates);
  // The field for patterns has another use in these streams: the face by which the cell came, from which the
  // turn of the next cell is expected.
  hull_.cell(last_.slot).pattern = entered_by_;
  hull_.cell(last_.slot).signature = signature_;
  last_signature_ = signature_;
  if (gated) {
    code_ends_at_gates(topology, cell);
  } else {
    code_finals(topology, cell, true);
    follow_group();
  }
  if (faces_ && cell_.shape().dimension == 3) faces_->close_under(*this, last_.slot);
  remove_final(cell, out);
  return true;
}

/// Codes the kind of the cell and its gate. Returns whether it is of those kinds that have gates: solids and
/// polygons. In a regular mesh it takes one decision, "a cell of the last kind at the first gate".
template <class Coder>
bool CellCoder<Coder>::code_gate(Coder& coder, const StreamedCell& cell, bool& at_gate) {
  GateModels& models = *gate_models_;
  cell_.kind = last_kind_;
  const auto has_gates = [&] { return cell_.kind < shape_count && cell_shapes[cell_.kind].dimension >= 2; };
  FaceRef gate = has_gates() ? gates_->next(hull_) : FaceRef{};
  // Encoder: no_turn stays where the cell does not lie at this gate.
  Turn turn = no_turn;
  if (gate.cell != no_slot) {
    if constexpr (encoding) {
      if (cell.kind == cell_.kind) {
        find_targets(cell);
        turn = turn_at(gate);
      }
    }
    const bool plain = models.plain[models.outcomes].code(coder, turn != no_turn);
    models.outcomes = (models.outcomes * 2 + plain) & 15;
    if (plain) {
      at_gate = true;
      join_gate(coder, gate, turn);
      return true;
    }
  }
  cell_.kind = code_kind(coder, cell.kind);
  if (damaged_ || !has_gates()) return false;
  // most_skipped stands for "at no gate".
  unsigned distance = most_skipped;
  if constexpr (encoding) {
    find_targets(cell);
    const unsigned place = gates_->find(hull_, most_skipped, [&](FaceRef there) {
      turn = turn_at(there);
      return turn != no_turn;
    });
    if (turn != no_turn) distance = place;
  }
  if (!models.attached.code(coder, distance < most_skipped)) return true;
  for (unsigned i = 0; i < most_skipped; ++i) {
    gate = gates_->next(hull_);
    if (gate.cell == no_slot) break;
    if (models.here.code(coder, i == distance)) {
      at_gate = true;
      join_gate(coder, gate, turn);
      return true;
    }
    // Both sides drop the gates that were passed over. This is what keeps the queue from filling up with
    // faces that no cell ever meets.
    gates_->close(hull_, gate);
  }
  // The stream said that a gate is near, but none of 64 was taken.
  damaged_ = true;
  return false;
}

/// Encoder: the turn with which the cell lies at a gate; no_turn if it does not. Mirrored turns first:
/// neighbours of the same orientation see their face in opposite directions.
template <class Coder>
unsigned CellCoder<Coder>::turn_at(FaceRef gate) const {
  const Hull::Cell& other = hull_.cell(gate.cell);
  const CellFace& there = Hull::shape_of(other).face[gate.face];
  const CellShape& shape = cell_.shape();
  const uint32_t first = other.corner[there.corner[0]];
  for (unsigned i = 0; i < shape.corners; ++i) {
    if (target_[i] != first) continue;
    for (unsigned faces = shape.faces_at[i]; faces != 0; faces &= faces - 1) {
      const auto face = static_cast<unsigned>(__builtin_ctz(faces));
      const CellFace& own = shape.face[face];
      if (own.size != there.size) continue;
      unsigned rotation = 0;
      while (own.corner[rotation] != i) ++rotation;
      for (const bool mirrored : {true, false}) {
        if (matches_turn(other, gate.face, turn_of(face, mirrored, rotation)))
          return turn_of(face, mirrored, rotation);
      }
    }
  }
  return no_turn;
}

/// How the cell lies at its gate, then which of the faces beside it meets. The turn is expected from the last
/// cell in the same row: same kind, same face of the gate's cell, which itself came by the same face.
template <class Coder>
void CellCoder<Coder>::join_gate(Coder& coder, FaceRef gate, unsigned turn) {
  GateModels& models = *gate_models_;
  const Hull::Cell& other = hull_.cell(gate.cell);
  anchor_signature_ = other.signature;
  const unsigned row = cell_.kind * 64 + gate.face * 8 + (other.pattern & 7);
  uint8_t& last = models.last_turn[row];
  if (models.same_turn[row].code(coder, turn == last)) {
    turn = last;
  } else {
    BitModel* const tree = models.turn.data() + size_t{row} * 64;
    unsigned node = 1;
    for (unsigned level = 0; level < 6; ++level) {
      const bool bit = (turn >> (5 - level) & 1) != 0;
      node = node * 2 +
             decide_by(tree[node], coder, bit, turn_bit, row << 6 | node, other.signature, last * 64u + node);
    }
    turn = node - 64;
  }
  const unsigned size = Hull::shape_of(other).face[gate.face].size;
  const CellShape& shape = cell_.shape();
  const unsigned own = turn / 8;
  // Six bits can say turns that the kind does not have; each part is checked before it is used as an index.
  damaged_ = damaged_ || own >= shape.faces || shape.face[own].size != size || turn % 4 >= size;
  if (damaged_) return;
  last = static_cast<uint8_t>(turn);
  entered_by_ = own;
  // From here on the gate's cell takes the place of the last cell: corners are named, and numbers expected,
  // beside it.
  sources_.cell.fill(no_slot);
  sources_.cell[0] = gate.cell;
  place(gate, turn);
  if (shape.dimension == 3) {
    join_beside(coder, gate, own);
  } else {
    code_faces_below(coder, gate);
  }
}

/// The open face at the end of the cells around an edge, from a cell's face on over its other faces there.
/// There is none where a walk ends otherwise (at a point that has left, at the limit), or where it would be a
/// face of the cell itself. Glued faces know how they lie on each other, so that the walk follows tables and
/// compares points only in odd meshes.
template <class Coder>
typename CellCoder<Coder>::Opposite CellCoder<Coder>::open_face_around(FaceRef from, uint32_t a,
                                                                       uint32_t b) const {
  Opposite found;
  const uint32_t start = from.cell;
  unsigned edge = Gates::edge_between(hull_, from, a, b);
  for (found.around = 1; edge != Gates::no_edge && found.around < most_around_edge; ++found.around) {
    const Gates::Cell& cell = gates_->cell(from.cell);
    const CellShape& shape = cell_shapes[cell.kind];
    const CellFace& face = shape.face[from.face];
    const unsigned next = face.across[edge];
    edge = face.edge_across[edge];
    if (cell.across[next] == no_slot) {
      if (from.cell != start) set_opposite({from.cell, next}, edge, a, found);
      return found;
    }
    from = {cell.across[next] / 8, cell.across[next] % 8};
    edge = Gates::edge_across(cell.turn[next], shape.face[next].size, edge);
    if (edge == Gates::no_edge) edge = Gates::edge_between(hull_, from, a, b);
  }
  return found;
}

/// Fills `found` with a face at whose edge number `edge` the walk has ended, if that face is open, with the
/// points next to both ends of the edge.
template <class Coder>
void CellCoder<Coder>::set_opposite(FaceRef face, unsigned edge, uint32_t a, Opposite& found) const {
  const Hull::Cell& cell = hull_.cell(face.cell);
  if ((cell.open >> face.face & 1) == 0) return;
  const CellFace& open = Hull::shape_of(cell).face[face.face];
  const auto point = [&](unsigned i) { return cell.corner[open.corner[i < open.size ? i : i - open.size]]; };
  const uint32_t before = point(edge + open.size - 1), after = point(edge + 2);
  const bool forward = point(edge) == a;
  found.face = face;
  found.size = open.size;
  found.next_to_a = forward ? before : after;
  found.next_to_b = forward ? after : before;
}

/// At each edge of the gate the cells there lead to one open face: is it one of this cell's? Around an inner
/// edge whose other cells are all there the answer is mostly yes, so that `around` and the agreement of the
/// faces beside it lead the context.
template <class Coder>
void CellCoder<Coder>::join_beside(Coder& coder, FaceRef gate, unsigned own_face) {
  const CellShape& shape = cell_.shape();
  const CellFace& base = shape.face[own_face];
  std::array<Opposite, 4> opposite;
  const std::array<Beyond, 4>& own = beyond_edges()[cell_.kind][own_face];
  for (unsigned i = 0; i < base.size; ++i) {
    const unsigned a = base.corner[i], b = base.corner[i + 1u < base.size ? i + 1 : 0];
    opposite[i] = open_face_around(gate, cell_.corner[a], cell_.corner[b]);
    Opposite& there = opposite[i];
    if (there.face.cell == no_slot) continue;
    // Faces of other sizes, and faces that no cell will meet, cannot be the cell's.
    if (there.size != shape.face[base.across[i]].size || !gates_->is_gate(there.face))
      there.face.cell = no_slot;
  }
  unsigned joined = 0;
  for (unsigned i = 0; i < base.size; ++i) {
    const Opposite& there = opposite[i];
    const unsigned after = i + 1u < base.size ? i + 1 : 0, before = i == 0 ? base.size - 1u : i - 1;
    if (there.face.cell == no_slot) continue;
    const unsigned at_a = own[i].next_to_a, at_b = own[i].next_to_b;
    const bool knows_a = cell_.has(at_a), knows_b = cell_.has(at_b);
    // What is known already rules the face out; no decision is spent.
    if (knows_a && cell_.corner[at_a] != there.next_to_a) continue;
    if (knows_b && cell_.corner[at_b] != there.next_to_b) continue;
    // Both points next to the edge are the cell's already, so the face is, too: glued without a decision.
    bool here = knows_a && knows_b;
    if (!here) {
      if constexpr (encoding) here = target_[at_a] == there.next_to_a && target_[at_b] == there.next_to_b;
      // Do the faces beside lead to the same points?
      unsigned agree = 0, differ = 0;
      const auto count = [&](const Opposite& other, uint32_t its, uint32_t here) {
        if (other.face.cell == no_slot) return;
        agree += its == here;
        differ += its != here;
      };
      count(opposite[before], opposite[before].next_to_b, there.next_to_a);
      count(opposite[after], opposite[after].next_to_a, there.next_to_b);
      const unsigned context = std::min(there.around, 7u) | (knows_a || knows_b ? 8u : 0) | agree << 4 |
                               differ << 6 | std::min(joined, 2u) << 8 | std::min(i, 2u) << 10 |
                               (base.size - 3u) << 12 | (there.size - 3u) << 13;
      const uint32_t valence = hull_.point(cell_.corner[base.corner[i]]).valence() * 32u +
                               hull_.point(cell_.corner[base.corner[after]]).valence();
      here = decide_by(gate_models_->joined[context], coder, here, glued_here, context,
                       hashed(anchor_signature_, hull_.cell(there.face.cell).signature),
                       valence * 16 + std::min(there.around, 15u));
    }
    if (!here) continue;
    ++joined;
    cell_.set_corner(at_a, there.next_to_a);
    cell_.set_corner(at_b, there.next_to_b);
    cell_.set_glue(base.across[i], there.face);
  }
}

/// Glues faces that nobody asked about, beyond an edge of one that is glued. A face that only a search around
/// its points would find stays open: few are, and that search takes half as long as all the rest.
template <class Coder>
void CellCoder<Coder>::glue_beside() {
  const CellShape& shape = cell_.shape();
  for (unsigned f = 0; f < shape.faces; ++f) {
    if (cell_.is_glued(f) || (shape.corners_of[f] & ~cell_.known) != 0) continue;
    const CellFace& face = shape.face[f];
    for (unsigned i = 0; i < face.size && !cell_.is_glued(f); ++i) {
      const unsigned beside = face.across[i];
      if (!cell_.is_glued(beside)) continue;
      const unsigned after = i + 1u < face.size ? i + 1 : 0, before = i == 0 ? face.size - 1u : i - 1;
      const Opposite there = open_face_around(cell_.glue[beside], cell_.corner[face.corner[i]],
                                              cell_.corner[face.corner[after]]);
      if (there.face.cell == no_slot || there.size != face.size) continue;
      const unsigned next = after + 1u < face.size ? after + 1 : 0;
      if (there.next_to_a == cell_.corner[face.corner[before]] &&
          there.next_to_b == cell_.corner[face.corner[next]])
        cell_.set_glue(f, there.face);
    }
  }
}

/// A bit for each corner whose point is at the border.
template <class Coder>
unsigned CellCoder<Coder>::corners_on_border() const {
  unsigned marked = 0;
  for (unsigned i = 0; i < cell_.shape().corners; ++i)
    marked |= (gates_->on_border(cell_.corner[i]) ? 1u : 0u) << i;
  return marked;
}

/// Codes of each open face whether it is a gate; returns those. The encoder knows from the whole mesh
/// (`borders_`) which faces no later cell meets. Points of a border face are marked: faces around them are
/// mostly at the border, too.
template <class Coder>
unsigned CellCoder<Coder>::code_borders(Coder& coder) {
  const CellShape& shape = cell_.shape();
  unsigned gates = 0;
  const unsigned at_border =
      encoding && borders_ != nullptr && ordinal_ < borders_->size() ? (*borders_)[ordinal_] : 0;
  unsigned marked = corners_on_border();
  for (unsigned f = 0; f < shape.faces; ++f) {
    if (cell_.is_glued(f)) continue;
    const CellFace& face = shape.face[f];
    const unsigned known = bits_in(marked & shape.corners_of[f]);
    const unsigned fresh = bits_in(cell_.fresh & shape.corners_of[f]);
    const unsigned context =
        (known < 4 ? known : 3u) | (fresh < 4 ? fresh : 3u) << 2 | (face.size == 4 ? 16u : 0);
    const bool border =
        decide_by(gate_models_->border[cell_.kind * 64 + context], coder, (at_border >> f & 1) != 0,
                  border_here, context | cell_.kind << 6, anchor_signature_, f | cell_.glued << 3);
    if (!border) {
      gates |= 1u << f;
      continue;
    }
    for (unsigned i = 0; i < face.size; ++i) gates_->mark_border(cell_.corner[face.corner[i]]);
    marked = corners_on_border();  // of all corners, as two may be one point
  }
  return gates;
}

/// Points end when they have no gate left: mostly all corners at once, in one decision. What happened to the
/// last point at the border is expected for the next one, as files differ in whether cells beside a border
/// are still to come.
template <class Coder>
void CellCoder<Coder>::code_ends_at_gates(Coder& coder, StreamedCell& cell) {
  const CellShape& shape = cell_.shape();
  if (shape.nodes > shape.corners || repeated_ != 0) return code_finals(coder, cell, true);
  GateModels& models = *gate_models_;
  uint32_t done = 0;
  for (unsigned i = 0; i < shape.corners; ++i) done |= (gates_->at_point(node_[i]) == 0 ? 1u : 0u) << i;
  const uint32_t border = corners_on_border(), expected = models.border_ends ? done : done & ~border;
  if (models.ends.code(coder, cell.final == expected)) {
    cell.final = expected;
    return;
  }
  uint32_t final = 0;
  for (unsigned i = 0; i < shape.corners; ++i) {
    const unsigned context = (done >> i & 1) + 2 * (border >> i & 1);
    const bool ends = models.final[context].code(coder, (cell.final >> i & 1) != 0);
    final |= (ends ? 1u : 0u) << i;
    if (context == 3) models.border_ends = ends;
  }
  cell.final = final;
}

template bool CellCoder<RangeEncoder>::code_by_gates(RangeEncoder&, RangeEncoder&, StreamedCell&,
                                                     CodedCells&);
template bool CellCoder<RangeDecoder>::code_by_gates(RangeDecoder&, RangeDecoder&, StreamedCell&,
                                                     CodedCells&);

}  // namespace maille
