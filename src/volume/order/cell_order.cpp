#include "volume/order/cell_order.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <queue>
#include <span>
#include <utility>

#include "base/hash.h"
#include "volume/cells/cell_shape.h"

namespace maille {
namespace {

/// Simplices go round an edge, so that the cell reached last shares most with the front (see Waiting).
bool latest_first(unsigned kind) {
  return kind < shape_count && (cell_shapes[kind].corners == 4 || cell_shapes[kind].corners == 3);
}

unsigned kind_at(const CellBlock& block, uint64_t cell) {
  return kind_of(block.type == CellType::mixed ? static_cast<CellType>(block.types[cell]) : block.type);
}

/// Faces that wait for a second cell with the same points, in lists by their hash. The hash decides only
/// where a face is sought; matches are by points and in order of arrival, so that the result does not depend
/// on it.
class WaitingFaces {
 public:
  /// Two lists for each cell or more: tetrahedra have two faces each, hexahedra three.
  explicit WaitingFaces(uint64_t cells) {
    size_t lists = 16;
    while (lists < 2 * cells) lists *= 2;
    first_.assign(lists, none);
  }
  struct Face {
    uint64_t low, high;  ///< its points in ascending order, two each; unused ones are no point's number
    uint32_t cell, face;
  };
  /// Meets these faces in order: calls matched(face, other) for each that one waits for, which then waits no
  /// more. The others wait. Lists are in no order in memory, so that they are asked for ahead.
  template <class Matched>
  void meet(std::span<const Face> faces, Matched matched) {
    lists_.clear();
    for (const Face& face : faces) {
      lists_.push_back(list_of(face));
      __builtin_prefetch(&first_[lists_.back()]);
    }
    for (const size_t list : lists_) {
      if (first_[list] != none) __builtin_prefetch(&entries_[first_[list]]);
    }
    for (size_t i = 0; i < faces.size(); ++i) {
      if (const auto other = take(lists_[i], faces[i])) {
        matched(faces[i], *other);
      } else {
        wait(lists_[i], faces[i]);
      }
    }
  }
  /// In the order of the hash: callers may only set what does not depend on it.
  template <class Visit>
  void for_each(Visit visit) const {
    for (uint32_t at : first_) {
      for (; at != none; at = entries_[at].next) visit(entries_[at].face);
    }
  }

 private:
  /// Lists go through one array, and what left a list is used again.
  struct Entry {
    Face face;
    uint32_t next;
  };
  static constexpr uint32_t none = 0xffffffff;
  // Two faces of one mesh hardly collide, but a hostile mesh can make them: that costs time, not correctness.
  size_t list_of(const Face& face) const { return hash_mix(face.low, face.high) & (first_.size() - 1); }

  std::optional<Face> take(size_t list, const Face& face) {
    for (uint32_t* at = &first_[list]; *at != none; at = &entries_[*at].next) {
      Entry& entry = entries_[*at];
      if (entry.face.low != face.low || entry.face.high != face.high) continue;
      unused_ = std::exchange(*at, std::exchange(entry.next, unused_));
      return entry.face;
    }
    return {};
  }
  /// Newest first: of several faces that are the same there is never more than one here, as the second one
  /// takes the first.
  void wait(size_t list, const Face& face) {
    if (unused_ == none) {
      unused_ = static_cast<uint32_t>(entries_.size());
      entries_.push_back({face, none});
    }
    const uint32_t free = std::exchange(unused_, entries_[unused_].next);
    entries_[free] = {face, std::exchange(first_[list], free)};
  }

  std::vector<uint32_t> first_;
  std::vector<Entry> entries_;
  std::vector<size_t> lists_;  ///< of the faces that meet() is given
  uint32_t unused_ = none;
};

/// Points in ascending order, by a sorting network for four; faces of three have no_cell last, which is no
/// point.
WaitingFaces::Face face_of(const CellFace& face, const uint32_t* corners, uint32_t cell, uint32_t number) {
  std::array<uint32_t, 4> point;
  point.fill(no_cell);
  for (unsigned i = 0; i < face.size; ++i) point[i] = corners[face.corner[i]];
  const auto order = [&](unsigned i, unsigned j) {
    const uint32_t low = std::min(point[i], point[j]), high = std::max(point[i], point[j]);
    point[i] = low, point[j] = high;
  };
  // Written out: compilers make a loop of a list of pairs, at half the speed.
  order(0, 1), order(2, 3), order(0, 2), order(1, 3), order(1, 2);
  return {uint64_t{point[0]} << 32 | point[1], uint64_t{point[2]} << 32 | point[3], cell, number};
}

// Cells without shape have no faces here, so that nothing is across them.
void add_faces(const CellBlock& block, uint32_t cell, std::vector<WaitingFaces::Face>& faces) {
  const unsigned kind = kind_at(block, cell);
  if (kind >= shape_count) return;
  const CellShape& shape = cell_shapes[kind];
  const auto points = block.cell(cell);
  std::array<uint32_t, most_corners> corners;
  for (unsigned i = 0; i < shape.corners; ++i) corners[i] = points[shape.place[i]];
  for (unsigned f = 0; f < shape.faces; ++f) faces.push_back(face_of(shape.face[f], corners.data(), cell, f));
}

/// More waiting faces first; then, of tetrahedra, the latest reached, of others the earliest (5.7 instead
/// of 8.1 bits a tetrahedron, 0.85 instead of 1.15 a hexahedron: tetrahedra go round an edge, hexahedra in
/// layers); then the lower number.
struct Waiting {
  uint32_t faces;
  uint32_t reached;
  uint32_t cell;

  bool operator<(const Waiting& other) const {
    if (faces != other.faces) return faces < other.faces;
    return reached != other.reached ? reached > other.reached : cell > other.cell;
  }
};

}  // namespace

/// Faces in bunches, so that the misses of the cache of many faces overlap.
Neighbours neighbours_of(const CellBlock& block, std::vector<uint8_t>* on_border) {
  std::array<uint32_t, most_faces> none;
  none.fill(no_cell);
  Neighbours neighbours(block.size(), none);
  WaitingFaces waiting(block.size());
  const auto link = [&](const WaitingFaces::Face& face, const WaitingFaces::Face& other) {
    if (face.cell == other.cell) return;
    neighbours[face.cell][face.face] = other.cell;
    neighbours[other.cell][other.face] = face.cell;
  };
  constexpr size_t at_once = 128;  // 44 ns a face of 558,000 tetrahedra, 48 for 64, 101 one by one
  std::vector<WaitingFaces::Face> faces;
  for (uint32_t cell = 0; cell < block.size(); ++cell) {
    add_faces(block, cell, faces);
    if (faces.size() < at_once) continue;
    waiting.meet(faces, link);
    faces.clear();
  }
  waiting.meet(faces, link);
  if (!on_border) return neighbours;
  // What still waits has no partner.
  waiting.for_each([&](const WaitingFaces::Face& face) {
    for (const uint64_t point :
         {face.low >> 32, face.low & 0xffffffff, face.high >> 32, face.high & 0xffffffff}) {
      if (point != no_cell) (*on_border)[point] = 1;
    }
  });
  return neighbours;
}

/// With a heap whose entries go out of date: each time a cell is reached again, a new entry is pushed. So
/// there are at most as many entries as faces.
std::vector<uint64_t> front_order(const CellBlock& block) {
  std::vector<uint64_t> order;
  if (block.size() >= no_cell) {
    order.resize(block.size());
    std::iota(order.begin(), order.end(), uint64_t{0});
    return order;
  }
  const auto neighbours = neighbours_of(block);
  std::vector<uint8_t> faces(block.size());  ///< that wait; 255: the cell is out
  std::vector<uint32_t> reached(block.size());
  std::priority_queue<Waiting> waiting;
  const auto take = [&](uint32_t cell) {
    const auto time = static_cast<uint32_t>(order.size());
    faces[cell] = 255;
    order.push_back(cell);
    for (const uint32_t other : neighbours[cell]) {
      if (other == no_cell || faces[other] == 255) continue;
      // Reached first at this time. The complement turns "earliest first" into "latest first".
      if (faces[other]++ == 0) reached[other] = latest_first(kind_at(block, other)) ? ~time : time;
      waiting.push({faces[other], reached[other], other});
    }
  };
  for (uint32_t start = 0; start < block.size(); ++start) {
    if (faces[start] == 255) continue;
    take(start);
    while (!waiting.empty()) {
      const Waiting next = waiting.top();
      waiting.pop();
      if (faces[next.cell] == next.faces) take(next.cell);  // else an entry that is out of date
    }
  }
  return order;
}

}  // namespace maille
