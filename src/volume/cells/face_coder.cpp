// Cells given by their faces, in the order in which docs/format.md, 16.8, has the steps.
// The points of faces that are new are coded in face_coder_loops.cpp.
#include "volume/cells/face_coder.h"

#include <algorithm>

#include "code/most_around.h"
#include "volume/cells/cell_coder.h"

namespace maille {
namespace {

// Bounds of docs/format.md, 16.8. Each keeps the work for one cell below a constant for each of its corners.
constexpr unsigned most_anchors = 40;
constexpr size_t most_hull_faces = 256;

constexpr uint32_t capped(size_t value, uint32_t most) {
  return value < most ? static_cast<uint32_t>(value) : most;
}

}  // namespace

/// Both cycles are compared from each place where `other` has the first point of `own`, eight at most.
bool lay_on(std::span<const uint32_t> own, std::span<const uint32_t> other, uint32_t& start, bool& same_way) {
  const size_t size = own.size();
  if (size != other.size()) return false;
  unsigned tries = 8;  // faces may have one point thousands of times
  for (size_t from = 0; from < size && tries > 0; ++from) {
    if (other[from] != own[0]) continue;
    --tries;
    bool back = true, forth = true;
    for (size_t i = 0; i < size && (back || forth); ++i) {
      back = back && own[i] == other[(from + size - i) % size];
      forth = forth && own[i] == other[(from + i) % size];
    }
    if (!back && !forth) continue;
    start = static_cast<uint32_t>(from);
    same_way = !back;
    return true;
  }
  return false;
}

/// Codes one cell: type, faces in memory (anchor, then members over edges), all faces in order, then what
/// ends.
template <class Coder>
bool FaceCoder<Coder>::code(Host& host, Coder& topology, Coder& numbers, StreamedCell& cell,
                            CodedCells& out) {
  begin(host, topology, numbers, cell, out);
  code_type();
  if (!damaged_ && cell.type == CellType::polyhedron) {
    if constexpr (encoding) find_matches();
    code_anchor();
    flood();
    code_faces();
  } else if (!damaged_) {
    code_polygon();
  }
  damaged_ = damaged_ || host.damaged_ || topology.exhausted() || numbers.exhausted();
  if (damaged_) return false;
  enter();
  code_finals();
  return true;
}

template <class Coder>
void FaceCoder<Coder>::begin(Host& host, Coder& topology, Coder& numbers, StreamedCell& cell,
                             CodedCells& out) {
  host_ = &host;
  coder_ = &topology;
  numbers_ = &numbers;
  cell_ = &cell;
  out_ = &out;
  ++cells_;
  recent_ = hashed(hashed(last_shapes_[0], last_shapes_[1]), last_shapes_[2]);
  members_.clear();
  hull_faces_.clear();
  border_.clear();
  points_.clear();
  nodes_.clear();
  sizes_.clear();
  brought_.clear();
  closing_.clear();
  if constexpr (!encoding) return;
  // Only an encoder knows where faces begin.
  begin_.assign(1, 0);
  if (cell.type != CellType::polyhedron) cell.sizes.assign(1, static_cast<uint32_t>(cell.numbers.size()));
  for (const uint32_t size : cell.sizes) begin_.push_back(begin_.back() + size);
}

/// The type is told apart from the kind, as cells of one kind are polyhedra, polygons, triangles or quads;
/// any other byte is damage.
template <class Coder>
void FaceCoder<Coder>::code_type() {
  const bool same = decide(cell_->type == last_type_, same_type, static_cast<uint32_t>(last_type_), 0, 0);
  if (same) {
    cell_->type = last_type_;
  } else {
    cell_->type = static_cast<CellType>(coder_->code_raw(static_cast<uint32_t>(cell_->type), 8));
  }
  last_type_ = cell_->type;
  damaged_ = last_type_ != CellType::polyhedron && last_type_ != CellType::polygon &&
             last_type_ != CellType::triangle && last_type_ != CellType::quad;
}

// Open faces in memory, those of the hull's cells among them.

template <class Coder>
void FaceCoder<Coder>::load(const OpenFace& face, std::vector<uint32_t>& loop) const {
  loop.clear();
  if (face.id != no_slot) {
    for (uint32_t i = 0; i < store_.face(face.id).size; ++i) loop.push_back(store_.point(face.id, i));
    return;
  }
  const Hull::Cell& cell = host_->hull_.cell(face.of_hull.cell);
  const CellFace& there = Hull::shape_of(cell).face[face.of_hull.face];
  for (unsigned i = 0; i < there.size; ++i) loop.push_back(cell.corner[there.corner[i]]);
}

template <class Coder>
// The slot of the cell that brought the face: slots of both memories come from the hull, so they tell cells
// apart.
uint32_t FaceCoder<Coder>::cell_of(const OpenFace& face) const {
  return face.id != no_slot ? store_.face(face.id).cell : face.of_hull.cell;
}

template <class Coder>
uint32_t FaceCoder<Coder>::size_of(const OpenFace& face) const {
  if (face.id != no_slot) return store_.face(face.id).size;
  return Hull::shape_of(host_->hull_.cell(face.of_hull.cell)).face[face.of_hull.face].size;
}

/// How many of the first corners of a face a cell has met: not of all, as a face may have a million.
template <class Coder>
uint32_t FaceCoder<Coder>::met_points(const OpenFace& face, uint32_t cell) const {
  uint32_t count = 0;
  for (uint32_t i = 0; i < size_of(face) && i < 16; ++i) {
    uint32_t point = no_slot;
    if (face.id != no_slot) {
      point = store_.point(face.id, i);
    } else {
      const Hull::Cell& other = host_->hull_.cell(face.of_hull.cell);
      point = other.corner[Hull::shape_of(other).face[face.of_hull.face].corner[i]];
    }
    count += point < met_.size() && met_[point] == cell;
  }
  return count;
}

/// Calls visit(face) for the open faces around a point, the newest first, those of the store before those of
/// the hull, until it returns true. It looks at 64 faces and 64 cells at most.
template <class Coder>
template <class Visit>
void FaceCoder<Coder>::open_faces_around(uint32_t slot, Visit visit) const {
  unsigned left = most_around;
  const bool done = store_.around(slot, [&](uint32_t id, uint32_t) {
    return (store_.face(id).open != 0 && visit(OpenFace{id, {}})) || --left == 0;
  });
  // Found among the faces of the store; `left` is 0 where it was the limit that ended the walk, and the hull
  // is still to be looked at.
  if (done && left != 0) return;
  left = most_around;
  host_->hull_.around(slot, [&](uint32_t cell, uint32_t corner) {
    const Hull::Cell& other = host_->hull_.cell(cell);
    if (Hull::shape_of(other).dimension == 3) {
      for (unsigned f = other.open & Hull::shape_of(other).faces_at[corner]; f != 0; f &= f - 1) {
        if (visit(OpenFace{no_slot, {cell, static_cast<uint32_t>(__builtin_ctz(f))}})) return true;
      }
    }
    return --left == 0;
  });
}

/// The open face with these points, in either direction; none if it is not among the first at the first
/// point.
template <class Coder>
typename FaceCoder<Coder>::OpenFace FaceCoder<Coder>::find_open(std::span<const uint32_t> loop) {
  OpenFace found;
  if (loop.empty()) return found;
  open_faces_around(loop[0], [&](const OpenFace& face) {
    if (size_of(face) != loop.size()) return false;
    load(face, scratch_);
    uint32_t start = 0;
    bool same_way = false;
    if (!lay_on(loop, scratch_, start, same_way)) return false;
    found = face;
    return true;
  });
  return found;
}

template <class Coder>
void FaceCoder<Coder>::close(const OpenFace& face) {
  if (face.id != no_slot) {
    store_.close(face.id);
  } else {
    Hull::Cell& cell = host_->hull_.cell(face.of_hull.cell);
    host_->hull_.close(cell, 1u << face.of_hull.face);
  }
}

/// Hexahedra beside polyhedra: their faces are in two memories, and a face that both have closes in both. A
/// face of the hull has no larger list than 64 faces to be sought in.
template <class Coder>
void FaceCoder<Coder>::close_under(Host& host, uint32_t cell) {
  if (store_.empty()) return;
  host_ = &host;
  for (unsigned f = host.hull_.cell(cell).open; f != 0; f &= f - 1) {
    const OpenFace own{no_slot, {cell, static_cast<uint32_t>(__builtin_ctz(f))}};
    load(own, loop_);
    OpenFace other;
    unsigned left = most_around;
    store_.around(loop_[0], [&](uint32_t id, uint32_t) {
      uint32_t start = 0;
      bool same_way = false;
      if (store_.face(id).open != 0 && store_.face(id).size == loop_.size()) {
        load({id, {}}, scratch_);
        if (lay_on(loop_, scratch_, start, same_way)) other.id = id;
      }
      return other.id != no_slot || --left == 0;
    });
    if (other.id == no_slot) continue;
    store_.close(other.id);
    close(own);
  }
}

// Encoder: which of the cell's faces are open in memory.

/// `corner` 17 to 24 of the point table: look-ups of faces do not disturb what cells of the hull remember.
template <class Coder>
uint32_t FaceCoder<Coder>::wanted_slot(uint32_t own, uint32_t place) {
  return host_->slot_of_input(cell_->numbers[begin_[own] + place], 17 + place % 8);
}

template <class Coder>
// Encoder: own face as slots. False: it has a point that is not in memory, so that no face there can be it.
bool FaceCoder<Coder>::load_own(uint32_t own) {
  loop_.clear();
  for (uint32_t i = 0; i < cell_->sizes[own]; ++i) {
    loop_.push_back(wanted_slot(own, i));
    if (loop_.back() == no_slot) return false;
  }
  return true;
}

/// Encoder: looks up each of the cell's faces once, so that all later questions about a face in memory are a
/// binary search.
template <class Coder>
void FaceCoder<Coder>::find_matches() {
  matches_.clear();
  member_of_.assign(cell_->sizes.size(), no_slot);
  for (uint32_t own = 0; own < cell_->sizes.size(); ++own) {
    if (!load_own(own)) continue;
    const OpenFace face = find_open(loop_);
    if (face.id != no_slot || face.of_hull.cell != no_slot) matches_.push_back({face, own});
  }
  // By own face, too, so that the sort is total.
  std::sort(matches_.begin(), matches_.end(), [](const Match& a, const Match& b) {
    return key_of(a.face) != key_of(b.face) ? key_of(a.face) < key_of(b.face) : a.own < b.own;
  });
}

/// The first of the cell's faces that is this one; no_slot for none.
template <class Coder>
uint32_t FaceCoder<Coder>::own_face_on(const OpenFace& face) const {
  const auto found =
      std::lower_bound(matches_.begin(), matches_.end(), key_of(face),
                       [](const Match& match, uint64_t key) { return key_of(match.face) < key; });
  return found != matches_.end() && key_of(found->face) == key_of(face) ? found->own : no_slot;
}

template <class Coder>
bool FaceCoder<Coder>::lies_on_face(Host& host, std::span<const uint64_t> numbers) {
  host_ = &host;
  if (store_.empty()) return false;
  loop_.clear();
  for (const uint64_t number : numbers) {
    loop_.push_back(host.slot_of_input(number, 17));
    if (loop_.back() == no_slot) return false;
  }
  return find_open(loop_).id != no_slot;
}

// The first face: that of a cell in memory from which the others are found.

/// Each candidate once; the list is short, so it is searched. The rank counts those of the same origin before
/// it.
template <class Coder>
void FaceCoder<Coder>::add_anchor(const OpenFace& face, unsigned origin) {
  if (anchors_.size() == most_anchors) return;
  uint8_t rank = 0;
  for (const Candidate& candidate : anchors_) {
    if (candidate.face == face) return;
    rank = static_cast<uint8_t>(rank + (candidate.origin == origin));
  }
  anchors_.push_back({face, static_cast<uint8_t>(origin), rank});
}

/// Open faces that have waited longest, for cells that come breadth first; those that the last cell brought;
/// those of the hull's last cell; those around the last cell's points.
template <class Coder>
void FaceCoder<Coder>::collect_anchors() {
  anchors_.clear();
  uint32_t waiting = store_.first_waiting();
  for (unsigned i = 0; i < 4 && waiting != no_slot; ++i, waiting = store_.face(waiting).after)
    add_anchor({waiting, {}}, 0);
  for (size_t i = 0; i < last_faces_.size() && i < 16; ++i) {
    if (store_.face(last_faces_[i]).open != 0) add_anchor({last_faces_[i], {}}, 1);
  }
  const CellRef last = host_->last_;
  if (host_->hull_.valid(last) && Hull::shape_of(host_->hull_.cell(last.slot)).dimension == 3) {
    for (unsigned f = host_->hull_.cell(last.slot).open; f != 0; f &= f - 1)
      add_anchor({no_slot, {last.slot, static_cast<uint32_t>(__builtin_ctz(f))}}, 2);
  }
  for (size_t i = 0; i < last_points_.size() && i < 16; ++i) {
    unsigned left = 6;
    open_faces_around(last_points_[i], [&](const OpenFace& face) {
      add_anchor(face, 3);
      return --left == 0;
    });
  }
}

/// Which of the candidates is a face of this cell. A cell may have none: it is then made of new faces only,
/// unless one is named by a point.
template <class Coder>
void FaceCoder<Coder>::code_anchor() {
  collect_anchors();
  size_t chosen = 0;
  if constexpr (encoding) {
    while (chosen < anchors_.size() && own_face_on(anchors_[chosen].face) == no_slot) ++chosen;
  }
  const bool listed = !anchors_.empty() && decide(chosen < anchors_.size(), has_anchor, last_choice_, 0,
                                                  capped(anchors_.size(), 31));
  if (!listed) {
    const OpenFace distant = code_distant_anchor();
    last_choice_ = 63;
    if (distant.id != no_slot || distant.of_hull.cell != no_slot) add_member(distant);
    return;
  }
  for (size_t i = 0; i < anchors_.size(); ++i) {
    const Candidate& candidate = anchors_[i];
    const uint32_t met_before = met_points(candidate.face, cells_ - 1);
    const uint32_t passed = candidate.face.id != no_slot ? store_.face(candidate.face.id).passed : 0;
    const uint32_t local = candidate.origin | capped(candidate.rank, 7) << 2 | capped(passed, 3) << 5;
    const bool here = i + 1 == anchors_.size() ||
                      decide(i == chosen, anchor_here, local, last_choice_ << 4 | capped(met_before, 7),
                             capped(size_of(candidate.face), 15) << 3 | capped(met_before, 7));
    if (!here) continue;
    // Faces that were passed over in the row lose their place in front, as FaceStore::first_waiting() has it.
    if (candidate.origin == 0) {
      for (size_t k = 0; k < i; ++k) {
        FaceStore::Face& face = store_.face(anchors_[k].face.id);
        face.passed = static_cast<uint8_t>(face.passed + (face.passed < 255));
      }
    }
    last_choice_ = candidate.origin * 8u + capped(candidate.rank, 7);
    add_member(candidate.face);
    return;
  }
}

/// An anchor that is not among the candidates, by one of its points; at most 16 of the encoder's matches are
/// tried, so that a cell with very many faces at crowded points does not take long.
template <class Coder>
typename FaceCoder<Coder>::OpenFace FaceCoder<Coder>::code_distant_anchor() {
  OpenFace wanted;
  uint32_t point = no_slot;
  if constexpr (encoding) {
    for (size_t m = 0; m < matches_.size() && m < 16 && point == no_slot; ++m) {
      wanted = matches_[m].face;
      point = point_with(wanted);
    }
  }
  if (!decide(point != no_slot, by_point, static_cast<uint32_t>(cell_->type), last_choice_, 0)) return {};
  return code_around(point, wanted);
}

/// Encoder: a point of the face, so that it is among those that are looked at around the point.
template <class Coder>
uint32_t FaceCoder<Coder>::point_with(const OpenFace& wanted) {
  load(wanted, scratch_);
  for (const uint32_t point : scratch_) {
    bool seen = false;
    open_faces_around(point, [&](const OpenFace& face) { return seen = face == wanted; });
    if (seen) return point;
  }
  return no_slot;
}

/// The number of a point, then which of the open faces around it.
template <class Coder>
typename FaceCoder<Coder>::OpenFace FaceCoder<Coder>::code_around(uint32_t point, const OpenFace& wanted) {
  OpenFace found;
  point = host_->code_old_point(*coder_, point, last_anchor_point_);
  damaged_ = damaged_ || host_->damaged_;
  if (damaged_) return found;
  last_anchor_point_ = host_->number_of(point);
  unsigned rank = 0;
  bool taken = false;
  open_faces_around(point, [&](const OpenFace& face) {
    taken = decide(face == wanted, anchor_here, 0x1000 | capped(rank++, 31), 0, 0);
    if (taken) found = face;
    return taken;
  });
  damaged_ = damaged_ || !taken;
  return found;
}

// Members: faces of the cell that are open in memory.

/// The face is the cell's: its direction is told, its points are met, and its edges join the border.
template <class Coder>
void FaceCoder<Coder>::add_member(const OpenFace& face) {
  Member member;
  member.face = face;
  load(face, scratch_);
  if constexpr (encoding) {
    member.own = own_face_on(face);
    member_of_[member.own] = static_cast<uint32_t>(members_.size());
    load_own(member.own);
    lay_on(loop_, scratch_, member.start, member.same_way);
  }
  member.same_way = decide(member.same_way, turned_over, last_way_, 0, 0);
  last_way_ = member.same_way;
  // 255 keeps it from being asked about again.
  if (uint8_t* asked = asked_about(face)) *asked = 255;
  for (size_t i = 0; i < scratch_.size(); ++i) {
    meet(scratch_[i]);
    const uint32_t a = scratch_[i], b = scratch_[(i + 1) % scratch_.size()];
    if (member.same_way)
      add_edge(a, b);
    else
      add_edge(b, a);
  }
  members_.push_back(member);
}

/// How often the cell was asked whether it has this face: 255 if it has. Faces of the store count in
/// themselves; those of the hull have no room there, and are listed up to 256 for a cell; nullptr for more,
/// which are not asked about.
template <class Coder>
uint8_t* FaceCoder<Coder>::asked_about(const OpenFace& face) {
  if (face.id != no_slot) {
    FaceStore::Face& known = store_.face(face.id);
    if (known.asked_by != cells_) known.asked = 0;
    known.asked_by = cells_;
    return &known.asked;
  }
  for (auto& [other, asked] : hull_faces_) {
    if (other == face) return &asked;
  }
  if (hull_faces_.size() >= most_hull_faces) return nullptr;
  hull_faces_.push_back({face, 0});
  return &hull_faces_.back().second;
}

/// Goes from face to face over edges: the open faces there are mostly the cell's, too. Each open face is
/// asked about twice at most, from two edges, so that the loop ends after as many steps as the members have
/// edges.
template <class Coder>
void FaceCoder<Coder>::flood() {
  std::vector<uint32_t> loop;
  for (size_t m = 0; m < members_.size() && !damaged_; ++m) {
    load(members_[m].face, loop);
    const uint32_t owner = cell_of(members_[m].face);
    for (size_t i = 0; i < loop.size(); ++i) flood_edge(owner, loop[i], loop[(i + 1) % loop.size()]);
    damaged_ = !encoding && coder_->exhausted();
  }
}

template <class Coder>
// At most 64 faces and 64 cells are looked at, and eight open faces become questions.
void FaceCoder<Coder>::flood_edge(uint32_t owner, uint32_t a, uint32_t b) {
  std::array<OpenFace, 8> found{};
  unsigned count = 0, faces = 0, open = 0, left = most_around;
  const auto add = [&](const OpenFace& face) {
    ++open;
    const uint8_t* asked = asked_about(face);
    if (asked != nullptr && *asked < 2 && count < found.size()) found[count++] = face;
  };
  store_.around(a, [&](uint32_t id, uint32_t place) {
    const FaceStore::Face& face = store_.face(id);
    const uint32_t next = place + 1 == face.size ? 0 : place + 1,
                   back = place == 0 ? face.size - 1 : place - 1;
    if (store_.point(id, next) == b || store_.point(id, back) == b) {
      ++faces;
      if (face.open != 0) add({id, {}});
    }
    return --left == 0;
  });
  left = most_around;
  host_->hull_.around(a, [&](uint32_t slot, uint32_t corner) {
    const Hull::Cell& cell = host_->hull_.cell(slot);
    const CellShape& shape = Hull::shape_of(cell);
    for (unsigned n = shape.dimension == 3 ? shape.neighbours[corner] : 0; n != 0; n &= n - 1) {
      const auto end = static_cast<unsigned>(__builtin_ctz(n));
      if (cell.corner[end] != b) continue;
      // A solid of the hull has two faces at each of its edges.
      faces += 2;
      for (unsigned f = cell.open & shape.faces_at[corner] & shape.faces_at[end]; f != 0; f &= f - 1)
        add({no_slot, {slot, static_cast<uint32_t>(__builtin_ctz(f))}});
    }
    return --left == 0;
  });
  for (unsigned i = 0; i < count; ++i) {
    uint8_t& asked = *asked_about(found[i]);
    // Asked about meanwhile, from this very edge, as one face may have it twice.
    if (asked >= 2) continue;
    const uint32_t met = met_points(found[i], cells_);
    const uint32_t local = capped(open, 7) | capped(faces, 15) << 3 |
                           (cell_of(found[i]) == owner ? 128u : 0) | asked * 256u | capped(met, 7) << 10;
    const bool here =
        decide(encoding && own_face_on(found[i]) != no_slot, is_member, local,
               capped(size_of(found[i]), 15) << 4 | capped(met, 15), capped(members_.size(), 31));
    asked = static_cast<uint8_t>(asked + 1);
    if (here) add_member(found[i]);
  }
}

// The faces in their order.

/// The cell's faces in their order: each is one of the members, or new. With the members used up, the end is
/// asked for before each further face. Every face costs a decision, and the counts are checked, so that a
/// damaged stream ends.
template <class Coder>
void FaceCoder<Coder>::code_faces() {
  line_up_members();
  const auto count = static_cast<uint32_t>(cell_->sizes.size());
  bool was_member = true;
  for (uint32_t own = 0; !damaged_; ++own) {
    const uint32_t place = capped(own, 15);
    bool member = members_left_ > 0;
    if (member) {
      const bool wanted = encoding && member_of_[own] != no_slot;
      member = decide(wanted, from_members, (was_member ? 1u : 0) | (border_.empty() ? 2u : 0) | place << 2,
                      capped(members_left_, 31), capped(members_.size(), 31));
    } else if (decide(encoding && own == count, is_end, border_.empty() ? 1 : 0, place,
                      capped(border_.size(), 31))) {
      break;
    }
    if (member)
      code_member(own);
    else
      code_loop(own);
    was_member = member;
    damaged_ = damaged_ || host_->damaged_ || (!encoding && coder_->exhausted()) ||
               nodes_.size() > most_face_corners || sizes_.size() > most_face_corners ||
               host_->exceeds(nodes_.size());
  }
}

/// Puts the members into a ring, the oldest first: mostly the cell has them in this order, or in none. Faces
/// of the hull are older than all of the store.
template <class Coder>
void FaceCoder<Coder>::line_up_members() {
  members_left_ = static_cast<uint32_t>(members_.size());
  line_.clear();
  for (uint32_t i = 0; i < members_left_; ++i) line_.push_back({i, 0, 0});
  // A total order: age, then face within a cell; ordinals are turned around so that the smallest is the
  // oldest, and differences stay right when they wrap.
  const auto age = [&](const OpenFace& face) -> std::pair<uint64_t, uint64_t> {
    if (face.id != no_slot) return {1, store_.face(face.id).order};
    return {0, (0xffffffff - (host_->ordinal_ - host_->hull_.cell(face.of_hull.cell).ordinal)) * uint64_t{8} +
                   face.of_hull.face};
  };
  std::stable_sort(line_.begin(), line_.end(), [&](const Place& a, const Place& b) {
    return age(members_[a.member].face) < age(members_[b.member].face);
  });
  for (uint32_t i = 0; i < members_left_; ++i) {
    line_[i].next = i + 1 == members_left_ ? 0 : i + 1;
    line_[i].back = i == 0 ? members_left_ - 1 : i - 1;
    members_[line_[i].member].place = i;
  }
  at_ = 0;
}

/// Which of the members comes, asked in the ring from the one behind the last; after 16 refusals the place in
/// the ring is told instead, so that a cell with thousands of members takes linear time.
template <class Coder>
void FaceCoder<Coder>::code_member(uint32_t own) {
  constexpr unsigned most_asked = 16;
  const uint32_t wanted = encoding ? members_[member_of_[own]].place : 0;
  uint32_t place = at_;
  bool found = false;
  for (unsigned rank = 0; rank < most_asked && !found; ++rank) {
    found = rank + 1 == members_left_ ||
            decide(place == wanted, member_here, rank | last_rank_ << 5, capped(members_left_, 31), own == 0);
    if (found)
      last_rank_ = rank;
    else
      place = line_[place].next;
  }
  if (!found) place = static_cast<uint32_t>(rank_model_.code(*coder_, static_cast<int64_t>(wanted)));
  // A decoder may be told a place that is no member's, or was used.
  damaged_ = damaged_ || place >= line_.size() || members_[line_[place].member].used;
  if (damaged_) return;
  Member& member = members_[line_[place].member];
  member.used = true;
  --members_left_;
  line_[line_[place].back].next = line_[place].next;
  line_[line_[place].next].back = line_[place].back;
  at_ = line_[place].next;
  closing_.push_back(member.face);
  load(member.face, scratch_);
  append_turned(member.start, member.same_way);
}

/// The face in scratch_, from its corner `start`, in its own direction or the other one.
template <class Coder>
void FaceCoder<Coder>::append_turned(uint32_t start, bool same_way) {
  const auto size = static_cast<uint32_t>(scratch_.size());
  start = code_start(start, size);
  if (damaged_) return;
  sizes_.push_back(size);
  for (uint32_t i = 0; i < size; ++i)
    nodes_.push_back(scratch_[(same_way ? start + i : start + size - i) % size]);
}

/// Where the cell's own face begins within the face in memory. Up to 32 corners by a tree of as many levels
/// as the size needs, larger ones as a difference.
template <class Coder>
uint32_t FaceCoder<Coder>::code_start(uint32_t start, uint32_t size) {
  if (size > 32) {
    start = static_cast<uint32_t>(start_model_.code(*coder_, static_cast<int64_t>(start)));
    damaged_ = damaged_ || start >= size;
    return start;
  }
  unsigned bits = 0, node = 1;
  while (1u << bits < size) ++bits;
  for (unsigned level = bits; level > 0; --level) {
    node = node * 2 +
           decide((start >> (level - 1) & 1) != 0, start_bit, size << 6 | node, last_start_, last_way_);
  }
  // The tree has room for a power of two, so that a damaged stream can exceed the size.
  start = node - (1u << bits);
  damaged_ = damaged_ || start >= size;
  last_start_ = start;
  return start;
}

template class FaceCoder<RangeEncoder>;
template class FaceCoder<RangeDecoder>;

}  // namespace maille
