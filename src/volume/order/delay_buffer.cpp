#include "volume/order/delay_buffer.h"

#include <algorithm>

#include "base/hash.h"

namespace maille {

/// The place of the cell taken last is free only now, as the caller has used that cell until here.
DelayedCell& DelayBuffer::next() {
  if (left_ != none) free_.push_back(left_);
  left_ = none;
  if (free_.empty()) {
    free_.push_back(static_cast<uint32_t>(places_.size()));
    places_.emplace_back();
  }
  filled_ = free_.back();
  free_.pop_back();
  return places_[filled_].cell;
}

/// The cell is the youngest one; it waits for its faces that the front has already.
void DelayBuffer::enter() {
  Place& place = places_[filled_];
  place.serial = ++serial_;
  place.faces_waiting = 0;
  place.older = youngest_;
  place.younger = none;
  (youngest_ == none ? oldest_ : places_[youngest_].younger) = filled_;
  youngest_ = filled_;
  ++count_;
  for (size_t i = 0; i < place.cell.numbers.size(); ++i) {
    Point& point = points_[place.cell.numbers[i]];
    ++point.cells;
    point.ended = point.ended || place.cell.last_use[i] != 0;
  }
  find_faces(place);
  meet_front(filled_);
}

/// A point that no cell waits with is forgotten.
bool DelayBuffer::end(uint64_t number) {
  const auto found = points_.find(number);
  if (found == points_.end()) return false;
  if (found->second.cells == 0) {
    points_.erase(found);
    return false;
  }
  found->second.ended = true;
  return true;
}

const CellShape* DelayBuffer::shape_at(uint32_t place) const {
  const unsigned kind = places_[place].cell.kind;
  return kind < shape_count ? &cell_shapes[kind] : nullptr;
}

/// Keys of faces by kind of face (size) and points in ascending order.
void DelayBuffer::find_faces(Place& place) const {
  if (place.cell.kind >= shape_count) return;
  const CellShape& shape = cell_shapes[place.cell.kind];
  for (unsigned f = 0; f < shape.faces; ++f) {
    std::array<uint64_t, 4> points{};
    const unsigned size = shape.face[f].size;
    for (unsigned i = 0; i < size; ++i) points[i] = place.cell.numbers[shape.place[shape.face[f].corner[i]]];
    std::sort(points.begin(), points.begin() + size);
    uint64_t key = size;
    for (unsigned i = 0; i < size; ++i) key = hash_mix(key ^ points[i], i + 1);
    place.face[f] = key;
  }
}

/// Enters the faces of a cell. A third cell with a face is not noted: of it only the front is known.
void DelayBuffer::meet_front(uint32_t at) {
  const CellShape* const shape = shape_at(at);
  Place& place = places_[at];
  for (unsigned f = 0; shape != nullptr && f < shape->faces; ++f) {
    Face& face = faces_[place.face[f]];
    if (face.place[0] == none) {
      face.place[0] = at;
    } else if (face.place[1] == none && face.place[0] != at) {
      face.place[1] = at;
    }
    place.faces_waiting += face.on_front;
  }
  if (place.faces_waiting == 0) return;
  reach(place);
  queue_.push_back({place.faces_waiting, place.rank, place.serial, at});
  std::push_heap(queue_.begin(), queue_.end());
}

/// The front meets a cell for the first time, which takes its place among those for which as many faces wait.
void DelayBuffer::reach(Place& place) const {
  const bool simplex = cell_shapes[place.cell.kind].corners <= 4;
  place.rank = simplex ? place.serial : taken_;
}

// A place may have another cell by now: its serial number tells.
bool DelayBuffer::is_current(const Candidate& candidate) const {
  const Place& place = places_[candidate.place];
  return place.serial == candidate.serial && place.faces_waiting == candidate.faces;
}

/// Most entries of the heap are out of date in the long run: they are swept when they are four times as many
/// as cells, so that the heap stays linear in these.
uint32_t DelayBuffer::choose() {
  if (queue_.size() > 4 * count_ + 1024) {
    const auto stale = [&](const Candidate& candidate) { return !is_current(candidate); };
    queue_.erase(std::remove_if(queue_.begin(), queue_.end(), stale), queue_.end());
    std::make_heap(queue_.begin(), queue_.end());
  }
  while (!queue_.empty()) {
    const Candidate best = queue_.front();
    std::pop_heap(queue_.begin(), queue_.end());
    queue_.pop_back();
    if (is_current(best)) return best.place;
  }
  return oldest_;
}

// The cell leaves the list by age, the front moves over its faces, and its last uses become those of the new
// order.
const DelayedCell& DelayBuffer::take() {
  if (left_ != none) free_.push_back(left_);
  left_ = choose();
  leave_list(left_);
  places_[left_].serial = 0;
  --count_;
  ++taken_;
  move_front(left_);
  mark_ends(places_[left_].cell);
  forget_old_faces();
  return places_[left_].cell;
}

// A list by age, doubly linked, for the oldest one at any time.
void DelayBuffer::leave_list(uint32_t at) {
  const Place& place = places_[at];
  (place.older == none ? oldest_ : places_[place.older].younger) = place.younger;
  (place.younger == none ? youngest_ : places_[place.younger].older) = place.older;
}

/// The faces of a cell that leaves come to the front, or leave it where they were there. Its neighbours among
/// the waiting cells get a new entry.
void DelayBuffer::move_front(uint32_t at) {
  const CellShape* const shape = shape_at(at);
  for (unsigned f = 0; shape != nullptr && f < shape->faces; ++f) {
    const auto found = faces_.find(places_[at].face[f]);
    if (found == faces_.end()) continue;  // a face of the cell that is there twice
    Face& face = found->second;
    if (face.place[0] == at) face.place[0] = face.place[1], face.place[1] = none;
    if (face.place[1] == at) face.place[1] = none;
    face.on_front = !face.on_front;
    face.point = places_[at].cell.numbers[shape->place[shape->face[f].corner[0]]];
    for (const uint32_t other : face.place) {
      if (other == none) continue;
      Place& place = places_[other];
      if (place.faces_waiting == 0) reach(place);
      place.faces_waiting = face.on_front ? place.faces_waiting + 1 : place.faces_waiting - 1;
      if (place.faces_waiting == 0) continue;
      queue_.push_back({place.faces_waiting, place.rank, place.serial, other});
      std::push_heap(queue_.begin(), queue_.end());
    }
    if (!face.on_front && face.place[0] == none) faces_.erase(found);
  }
}

/// A point ends with the last cell that has it, at all corners that are this point: last uses of the input
/// are those of another order.
void DelayBuffer::mark_ends(DelayedCell& cell) {
  for (const uint64_t number : cell.numbers) --points_[number].cells;
  for (size_t i = 0; i < cell.numbers.size(); ++i) {
    const Point& point = points_[cell.numbers[i]];
    cell.last_use[i] = point.ended && point.cells == 0 ? 1 : 0;
  }
  for (size_t i = 0; i < cell.numbers.size(); ++i) {
    if (cell.last_use[i] != 0) points_.erase(cell.numbers[i]);
  }
}

/// Faces on the surface of the mesh are on the front for ever: those at points that have ended go from time
/// to time, whenever there are twice as many faces as after the last sweep.
void DelayBuffer::forget_old_faces() {
  if (faces_.size() < 2 * kept_faces_ + 8 * count_ + 1024) return;
  for (auto at = faces_.begin(); at != faces_.end();) {
    const Face& face = at->second;
    const bool old = face.on_front && face.place[0] == none && points_.find(face.point) == points_.end();
    at = old ? faces_.erase(at) : std::next(at);
  }
  kept_faces_ = faces_.size();
}

}  // namespace maille
