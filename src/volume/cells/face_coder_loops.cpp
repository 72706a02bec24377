// Faces that are not open in memory, polygons, and what is left to do when all faces of a cell are known.
#include <algorithm>

#include "code/most_around.h"
#include "volume/cells/cell_coder.h"
#include "volume/cells/face_coder.h"

namespace maille {
namespace {

// The border is searched for each edge: 128 edges bound that. Edges beyond it are left out in both
// directions, and their corners cost more. Part of the format, as is the other one.
constexpr size_t most_border = 128;
constexpr unsigned most_joined = 8;

constexpr uint32_t capped(size_t value, uint32_t most) {
  return value < most ? static_cast<uint32_t>(value) : most;
}

}  // namespace

/// An edge meets the one that runs the other way; until then it is part of the border. Newest first:
/// neighbouring faces come one after the other.
template <class Coder>
void FaceCoder<Coder>::add_edge(uint32_t from, uint32_t to) {
  for (size_t i = border_.size(); i-- > 0;) {
    if (border_[i].from != to || border_[i].to != from) continue;
    border_.erase(border_.begin() + static_cast<ptrdiff_t>(i));
    return;
  }
  if (border_.size() < most_border) border_.push_back({from, to});
}

/// Notes a point of this cell once; the order in which points are met is the one in which their ends are
/// told.
template <class Coder>
void FaceCoder<Coder>::meet(uint32_t slot) {
  if (slot >= met_.size()) met_.resize(host_->hull_.point_capacity());
  if (met_[slot] == cells_) return;
  met_[slot] = cells_;
  points_.push_back(slot);
}

/// A face that is not in memory: corner after corner, until the end is told. Mostly each next corner follows
/// the border of what the cell has so far.
template <class Coder>
void FaceCoder<Coder>::code_loop(uint32_t own) {
  loop_.clear();
  last_fresh_ = false;
  for (uint32_t k = 0; !damaged_; ++k) {
    find_next();
    const uint32_t situation =
        capped(k, 15) | (closes_ ? 16u : 0) | next_count_ << 5 | (last_fresh_ ? 128u : 0);
    if (decide(encoding && k == cell_->sizes[own], face_ends, situation, capped(border_.size(), 31),
               last_size_))
      break;
    code_corner(encoding ? wanted_slot(own, k) : no_slot, encoding ? cell_->numbers[begin_[own] + k] : 0);
    damaged_ = damaged_ || host_->damaged_ || (!encoding && coder_->exhausted()) ||
               loop_.size() > most_face_corners || host_->exceeds(loop_.size());
  }
  if (damaged_) return;
  const auto size = static_cast<uint32_t>(loop_.size());
  for (uint32_t i = 0; i < size; ++i) add_edge(loop_[i], loop_[i + 1 == size ? 0 : i + 1]);
  brought_.emplace_back(static_cast<uint32_t>(nodes_.size()), size);
  nodes_.insert(nodes_.end(), loop_.begin(), loop_.end());
  sizes_.push_back(size);
  last_size_ = capped(size, 31);
}

/// Points to which a border edge leads on from the last corner, three at most. A border edge that leads to
/// the first corner closes the face.
template <class Coder>
void FaceCoder<Coder>::find_next() {
  next_count_ = 0;
  closes_ = false;
  for (size_t i = border_.size(); i-- > 0 && !loop_.empty();) {
    if (border_[i].to != loop_.back()) continue;
    if (border_[i].from == loop_[0])
      closes_ = true;
    else if (next_count_ < next_.size())
      next_[next_count_++] = border_[i].from;
  }
}

/// One corner, by the likeliest source first: the border's next point, a new point, any corner of the border,
/// a point joined to the last corner, any point by its number.
template <class Coder>
void FaceCoder<Coder>::code_corner(uint32_t wanted, uint64_t number) {
  const uint32_t k = capped(loop_.size(), 7);
  const uint32_t border = capped(border_.size(), 31);
  const auto take = [&](uint32_t slot) {
    last_fresh_ = false;
    loop_.push_back(slot);
    meet(slot);
  };
  for (uint32_t i = 0; i < next_count_; ++i) {
    if (decide(wanted == next_[i], over_edge, i | next_count_ << 2 | (closes_ ? 16u : 0) | k << 5, border, 0))
      return take(next_[i]);
  }
  const uint32_t situation = k | (last_fresh_ ? 8u : 0) | (closes_ ? 16u : 0) | (next_count_ > 0 ? 32u : 0);
  if (decide(wanted == no_slot, is_new, situation, border, capped(members_.size(), 31)))
    return create(number);
  unsigned rank = 0;
  // Twelve questions at most; the last 64 corners cannot come again soon, as a face rarely has a point twice.
  for (size_t i = border_.size(); i-- > 0 && rank < 12;) {
    const uint32_t point = border_[i].to;
    const size_t back = capped(loop_.size(), most_around);  // a face may have a million corners
    if (std::find(loop_.end() - static_cast<ptrdiff_t>(back), loop_.end(), point) != loop_.end()) continue;
    if (decide(wanted == point, corner_here, rank << 4 | (k == 0 ? 1u : 0), capped(k, 3) << 5 | border, 0))
      return take(point);
    ++rank;
  }
  find_joined();
  for (uint32_t i = 0; i < joined_.size(); ++i) {
    if (decide(wanted == joined_[i], joined_here, i, capped(joined_.size(), 31), k)) return take(joined_[i]);
  }
  const uint64_t base = loop_.empty() ? last_old_ : host_->number_of(loop_.back());
  const uint32_t slot = host_->code_old_point(*coder_, wanted, base);
  damaged_ = damaged_ || host_->damaged_;
  if (damaged_) return;
  last_old_ = host_->number_of(slot);
  take(slot);
}

/// Points that an edge of a face, or of a cell of the hull, joins to the last corner: eight at most. A new
/// point has no such edges.
template <class Coder>
void FaceCoder<Coder>::find_joined() {
  joined_.clear();
  if (loop_.empty() || last_fresh_) return;
  const auto add = [&](uint32_t point) {
    const bool known = point == no_slot || joined_.size() == most_joined ||
                       std::find(joined_.begin(), joined_.end(), point) != joined_.end() ||
                       std::find(loop_.end() - capped(loop_.size(), 8), loop_.end(), point) != loop_.end();
    if (!known) joined_.push_back(point);
  };
  unsigned left = most_around;
  store_.around(loop_.back(), [&](uint32_t id, uint32_t place) {
    const uint32_t size = store_.face(id).size;
    add(store_.point(id, place + 1 == size ? 0 : place + 1));
    add(store_.point(id, place == 0 ? size - 1 : place - 1));
    return --left == 0;
  });
  left = most_around;
  host_->hull_.around(loop_.back(), [&](uint32_t slot, uint32_t corner) {
    const Hull::Cell& cell = host_->hull_.cell(slot);
    for (unsigned n = Hull::shape_of(cell).neighbours[corner]; n != 0; n &= n - 1)
      add(cell.corner[static_cast<unsigned>(__builtin_ctz(n))]);
    return --left == 0;
  });
}

/// A new point. Its value is expected from the last two corners and the newest border edge: three near
/// points, in `behind`.
template <class Coder>
void FaceCoder<Coder>::create(uint64_t number) {
  NewPoint point;
  point.cell = static_cast<uint32_t>(out_->size());
  unsigned count = 0;
  for (size_t i = loop_.size(); i-- > 0 && count < 2;) point.behind[count++] = loop_[i];
  for (size_t i = border_.size(); i-- > 0 && count < 3;) {
    if (loop_.empty() || border_[i].to != loop_.back()) point.behind[count++] = border_[i].to;
  }
  point.slot = host_->create_point(*numbers_, number, false, 0, loop_.empty() ? 60 : 61);
  damaged_ = damaged_ || host_->damaged_;
  if (damaged_) return;
  point.number = encoding ? number : host_->number_of(point.slot);
  out_->points.push_back(point);
  loop_.push_back(point.slot);
  meet(point.slot);
  last_fresh_ = true;
}

// Polygons: mostly they lie on open faces, in the order of these.

template <class Coder>
void FaceCoder<Coder>::code_polygon() {
  OpenFace wanted;
  if constexpr (encoding) {
    if (load_own(0)) wanted = find_open(loop_);
  }
  const OpenFace face = code_below(wanted);
  if (face.id == no_slot) {
    if (!damaged_) code_loop(0);
    return;
  }
  load(face, scratch_);
  uint32_t start = 0;
  bool same_way = true;
  if constexpr (encoding) {
    load_own(0);
    lay_on(loop_, scratch_, start, same_way);
  }
  same_way = decide(same_way, turned_over, 2, 0, 0);
  append_turned(start, same_way);
  for (const uint32_t slot : nodes_) meet(slot);
  closing_.push_back(face);
}

/// The open face on which the polygon lies: one of the next four in the row, or one at a named point; id is
/// no_slot if it is a face of its own.
template <class Coder>
typename FaceCoder<Coder>::OpenFace FaceCoder<Coder>::code_below(const OpenFace& wanted) {
  uint32_t id = store_.next_below();
  for (unsigned i = 0; i < 4 && id != no_slot; ++i, id = store_.face(id).after) {
    if (!decide(wanted.id == id, below_here, i, last_below_, capped(store_.face(id).size, 15))) continue;
    last_below_ = i;
    store_.set_next_below(id);
    return {id, {}};
  }
  uint32_t point = no_slot;
  OpenFace found;
  if (encoding && wanted.id != no_slot) point = point_with(wanted);
  if (!decide(point != no_slot, by_point, 0x100, last_below_, 0)) return found;
  found = code_around(point, wanted);
  // Named by a point, it must be a face of the store.
  if (damaged_ || found.id == no_slot) {
    damaged_ = true;
    return found;
  }
  last_below_ = 4;
  store_.set_next_below(found.id);
  return found;
}

// All faces are known.

/// The cell comes into memory: faces that it has in common with others close, its own are brought.
template <class Coder>
void FaceCoder<Coder>::enter() {
  StreamedCell& cell = *cell_;
  CodedCells& out = *out_;
  if constexpr (!encoding) {
    cell.sizes = sizes_;
    cell.numbers.clear();
    for (const uint32_t slot : nodes_) cell.numbers.push_back(host_->number_of(slot));
  }
  std::array<uint32_t, most_faces> across;
  across.fill(no_slot);
  // Neighbours are the cells of the faces that close, each once and six at most: what predictors of cell
  // values look at.
  unsigned count = 0;
  for (size_t i = 0; i < closing_.size() && count < across.size(); ++i) {
    const uint32_t other = cell_of(closing_[i]);
    if (std::find(across.begin(), across.begin() + count, other) == across.begin() + count)
      across[count++] = other;
  }
  out.kinds.push_back(face_cell);
  out.begin.push_back(static_cast<uint32_t>(out.nodes.size()));
  out.nodes.insert(out.nodes.end(), nodes_.begin(), nodes_.end());
  out.across.push_back(across);
  for (const OpenFace& face : closing_) close(face);
  out.cell_slots.push_back(bring_faces());
}

/// Brings the faces that are new; those that nobody asked about but that an open face in memory equals close
/// here all the same. Returns the slot of the cell, which is free again at once if no face of it waits.
template <class Coder>
uint32_t FaceCoder<Coder>::bring_faces() {
  last_faces_.clear();
  last_points_ = points_;
  if (nodes_.empty()) return no_slot;
  const uint32_t slot = host_->hull_.take_cell();
  for (const auto& [begin, size] : brought_) {
    const auto loop = std::span(nodes_).subspan(begin, size);
    if (loop.empty()) continue;
    const OpenFace other = find_open(loop);
    if (other.id != no_slot || other.of_hull.cell != no_slot)
      close(other);
    else
      last_faces_.push_back(store_.add(loop, slot));
  }
  if (last_faces_.empty()) host_->hull_.give_back_cell(slot);
  return slot;
}

/// Ends of points, in the order in which the cell met them: `finals` of a point that is several corners are
/// all the same.
template <class Coder>
void FaceCoder<Coder>::code_finals() {
  final_.resize(met_.size());
  for (size_t i = 0; encoding && i < nodes_.size(); ++i) {
    if (cell_->finals[i] != 0) final_[nodes_[i]] = cells_;
  }
  for (size_t i = 0; i < points_.size(); ++i) {
    const uint32_t slot = points_[i];
    unsigned open = 0, faces = 0;
    store_.around(slot, [&](uint32_t id, uint32_t) {
      open += store_.face(id).open;
      return ++faces == most_around;
    });
    const unsigned of_store = open;
    host_->hull_.around(slot, [&](uint32_t other, uint32_t corner) {
      const Hull::Cell& known = host_->hull_.cell(other);
      open += static_cast<unsigned>(__builtin_popcount(known.open & Hull::shape_of(known).faces_at[corner]));
      return open > 30;
    });
    const bool polygon = cell_->type != CellType::polyhedron;
    const uint32_t local = capped(open, 15) | capped(faces, 31) << 4 | (polygon ? 512u : 0);
    if (decide(encoding && final_[slot] == cells_, is_final, local, capped(of_store, 15),
               hashed(local, recent_)))
      final_[slot] = cells_;
    damaged_ = damaged_ || (!encoding && coder_->exhausted());
  }
  if constexpr (!encoding) {
    cell_->finals.clear();
    for (const uint32_t slot : nodes_) cell_->finals.push_back(final_[slot] == cells_);
  }
  for (const uint32_t slot : points_) {
    if (final_[slot] == cells_) host_->end_point(slot, *out_);
  }
  last_shapes_ = {hashed(capped(members_.size(), 31), capped(sizes_.size(), 31)), last_shapes_[0],
                  last_shapes_[1]};
}

// The members defined here, one by one: the class itself is instantiated beside its other members.
#define MAILLE_INSTANTIATE(Coder)                               \
  template void FaceCoder<Coder>::code_loop(uint32_t);          \
  template void FaceCoder<Coder>::code_polygon();               \
  template void FaceCoder<Coder>::add_edge(uint32_t, uint32_t); \
  template void FaceCoder<Coder>::meet(uint32_t);               \
  template void FaceCoder<Coder>::enter();                      \
  template void FaceCoder<Coder>::code_finals()
MAILLE_INSTANTIATE(RangeEncoder);
MAILLE_INSTANTIATE(RangeDecoder);
#undef MAILLE_INSTANTIATE

}  // namespace maille
