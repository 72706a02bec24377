#include "surface/arrays/corner_faces.h"

#include <algorithm>
#include <array>
#include <utility>

#include "code/most_around.h"
#include "surface/fans/placed_weights.h"
#include "surface/front/element_walk.h"

namespace maille {
namespace {

using R = VertexReferences;

/// Triangles need no links: their corners follow from remainders.
void link_corners(CornerFaces& faces) {
  if (faces.offsets.empty()) return;
  faces.following.resize(faces.corners());
  faces.preceding.resize(faces.corners());
  for (uint32_t f = 0; f < faces.faces(); ++f) {
    const uint32_t begin = faces.first(f), end = faces.first(f + 1);
    for (uint32_t c = begin; c < end; ++c) {
      faces.following[c] = c + 1 < end ? c + 1 : begin;
      faces.preceding[faces.following[c]] = c;
    }
  }
}

/// Edges that run both ways between two points are glued, the newest first, without a sort: corners wait in
/// lists by point, and most points have few that wait. Edges that more faces share are glued by chance of
/// order; predictions only need the same choice on both sides. No more than most_around corners of a list
/// are looked at.
void glue_corners(CornerFaces& faces) {
  const uint32_t count = faces.corners();
  faces.opposite.assign(count, none);
  std::vector<uint32_t> waiting(faces.point_count, none);  // by point: the newest corner without opposite
  std::vector<uint32_t> older(count);
  for (uint32_t c = 0; c < count; ++c) {
    const uint32_t from = faces.points[c], to = faces.points[faces.next(c)];
    uint32_t* at = &waiting[to];
    unsigned left = most_around;
    while (*at != none && left != 0 && faces.points[faces.next(*at)] != from) {
      at = &older[*at];
      --left;
    }
    if (*at == none || left == 0) {
      older[c] = waiting[from];
      waiting[from] = c;
      continue;
    }
    faces.opposite[c] = *at;
    faces.opposite[*at] = c;
    *at = older[*at];
  }
}

/// A parallelogram, a + b - across, and how good it is: the first of an element names its place.
struct Parallelogram {
  enum Quality : uint8_t { of_triangle, of_face, straight };
  uint32_t a, b, across;
  Quality quality;
};
constexpr unsigned most_parallelograms = 3;

/// What predicts one element: up to three parallelograms in the order in which faces come, and a known edge
/// or neighbour where there is none.
struct Around {
  std::array<Parallelogram, most_parallelograms> parallelograms;
  uint32_t first = none, second = none;  ///< a known edge, or one known neighbour
  uint8_t count = 0;

  void add(const Parallelogram& parallelogram) {
    if (count < most_parallelograms) parallelograms[count++] = parallelogram;
  }
  /// The first known edge stays; one neighbour alone only as long as there is no edge.
  void see(uint32_t a, uint32_t b) {
    if (second != none) return;
    if (b != none) {
      first = a;
      second = b;
    } else if (first == none) {
      first = a;
    }
  }
};

/// Finds references, kinds and valences of elements from the faces alone, in one pass over the faces in coded
/// order, as positions of fans have them from the walk. `element` is by corner. docs/format.md, 13.3.
class ReferenceFinder {
 public:
  ReferenceFinder(const CornerFaces& faces, std::span<const uint32_t> element, uint32_t count)
      : faces_(faces), element_(element), around_(count) {
    result_.vertices = count;
    result_.valences.resize(count);
  }

  FanSurface run() {
    if (faces_.offsets.empty()) {
      for (uint32_t c = 0; c < faces_.corners(); c += 3) look_at_triangle(c);
    } else {
      for (uint32_t c = 0; c < faces_.corners(); ++c) look_at(c);
    }
    // Straight lines only where nothing better is there.
    for (const uint32_t c : straight_) look_straight_on(c);
    const auto count = static_cast<uint32_t>(around_.size());
    result_.references.resize(count);
    result_.kinds.resize(count);
    for (uint32_t e = 0; e < count; ++e) describe(e);
    return std::move(result_);
  }

 private:
  /// The same as look_at() for the three corners of a triangle from `first` on, in one look: only the newest
  /// element has a parallelogram, and the oldest sees nothing. With other passes saved, decoding texture
  /// coordinates takes 8 to 10 % fewer instructions (3581143).
  void look_at_triangle(uint32_t first) {
    const uint32_t* const of = element_.data() + first;
    for (unsigned k = 0; k < 3; ++k) ++result_.valences[of[k]];
    const unsigned newest = of[0] > of[1] ? (of[0] > of[2] ? 0u : 2u) : (of[1] > of[2] ? 1u : 2u);
    const unsigned next = newest == 2 ? 0 : newest + 1, previous = newest == 0 ? 2 : newest - 1;
    const uint32_t e = of[newest], i = of[next], j = of[previous];
    // Of one element twice, in damaged files, neither is before the other.
    if (i >= e || j >= e) return look_at_each(first);
    if (i != j) around_[i < j ? j : i].see(i < j ? i : j, none);
    around_[e].see(i, j);
    add_parallelogram_across(e, i, j, faces_.opposite[first + next]);
  }
  void look_at_each(uint32_t first) {
    for (uint32_t c = first; c < first + 3; ++c) {
      --result_.valences[element_[c]];
      look_at(c);
    }
  }

  /// One corner, which is the newest of what it sees, or not: only elements before it count.
  void look_at(uint32_t c) {
    const uint32_t e = element_[c], next = faces_.next(c), previous = faces_.previous(c);
    const uint32_t i = element_[next], j = element_[previous];
    ++result_.valences[e];
    if (i < e && j < e) {
      around_[e].see(i, j);
      if (!faces_.is_triangle(c)) {
        const uint32_t across = element_[faces_.next(next)];
        if (across < e) around_[e].add({i, j, across, Parallelogram::of_face});
        return;
      }
      add_parallelogram_across(e, i, j, faces_.opposite[next]);
    } else if (i < e || j < e) {
      around_[e].see(i < e ? i : j, none);
      if (!faces_.is_triangle(c)) straight_.push_back(c);
    }
  }

  /// `over`: the corner from which the face on the other side runs from the point of j to that of i. If its
  /// corners there are of other elements, a seam lies between, and what is across belongs to another piece of
  /// the array.
  void add_parallelogram_across(uint32_t e, uint32_t i, uint32_t j, uint32_t over) {
    if (over == none || element_[over] != j || element_[faces_.next(over)] != i) return;
    const uint32_t across = element_[faces_.previous(over)];
    if (across < e) around_[e].add({i, j, across, Parallelogram::of_triangle});
  }

  /// One neighbour in the face is known, and the corner behind it: on from the face beyond.
  void look_straight_on(uint32_t c) {
    const uint32_t e = element_[c], next = faces_.next(c), previous = faces_.previous(c);
    const uint32_t i = element_[next], j = element_[previous];
    if (around_[e].count == most_parallelograms) return;
    if (i < e && element_[faces_.next(next)] < e) {
      const uint32_t over = faces_.opposite[next];
      if (over == none || element_[faces_.next(over)] != i) return;
      const uint32_t across = element_[faces_.next(faces_.next(over))];
      if (across < e) around_[e].add({i, i, across, Parallelogram::straight});
    } else if (j < e && element_[faces_.previous(previous)] < e) {
      const uint32_t over = faces_.opposite[faces_.previous(previous)];
      if (over == none || element_[over] != j) return;
      const uint32_t across = element_[faces_.previous(over)];
      if (across < e) around_[e].add({j, j, across, Parallelogram::straight});
    }
  }

  /// Kinds are those of fans, so that one coder serves both: place, a flag for which of two comes first, a
  /// late triple.
  void describe(uint32_t e) {
    R& references = result_.references[e];
    uint8_t& kind = result_.kinds[e];
    const Around& around = around_[e];
    if (around.count > 0) {
      kind = of_parallelograms(around, references);
    } else if (around.second != none) {
      references.at.fill(std::min(around.first, around.second));
      references.at[R::last] = std::max(around.first, around.second);
      kind = kind_of(edge_place, around.first > around.second, false);
    } else {
      references.at.fill(around.first != none ? around.first : e > 0 ? e - 1 : 0);
      kind = kind_of(start_place, false, false);
    }
  }

  /// References have room for three parallelograms in the roles that fans gave them: gate, late and closing.
  /// The closing one must share an element with the gate's edge, so it is chosen among the others, and
  /// decides which end of the edge is the focus; else the newer end is `last`.
  static uint8_t of_parallelograms(Around around, R& references) {
    auto& parallelograms = around.parallelograms;
    bool swapped = parallelograms[0].a > parallelograms[0].b;
    uint32_t focus = std::min(parallelograms[0].a, parallelograms[0].b),
             last = std::max(parallelograms[0].a, parallelograms[0].b);
    const unsigned closing =
        around.count == most_parallelograms ? closing_parallelogram(parallelograms, focus, last) : 0;
    if (closing != 0) {
      std::swap(parallelograms[closing], parallelograms[2]);
      if (parallelograms[2].a != focus && parallelograms[2].b != focus) {
        std::swap(focus, last);
        swapped = !swapped;
      }
    }
    references.at.fill(focus);
    references.at[R::last] = last;
    references.at[R::before] = parallelograms[0].across;
    if (around.count > 1) {
      references.at[R::late] = parallelograms[1].a;
      references.at[R::late + 1] = parallelograms[1].b;
      references.at[R::late + 2] = parallelograms[1].across;
    }
    const Parallelogram::Quality quality = parallelograms[0].quality;
    if (closing == 0) return kind_of(first_open_place + quality, swapped, around.count > 1);
    references.at[R::next] = parallelograms[2].a == focus ? parallelograms[2].b : parallelograms[2].a;
    references.at[R::next_opposite] = parallelograms[2].across;
    // Two of the places that count as closing, and have a third parallelogram; the others stay unused.
    return kind_of(quality == Parallelogram::of_triangle ? 0 : 2, swapped, true);
  }
  /// One of the other two that has an element of the first one's edge; 0 for none.
  static unsigned closing_parallelogram(const std::array<Parallelogram, most_parallelograms>& parallelograms,
                                        uint32_t focus, uint32_t last) {
    for (unsigned g = 1; g < most_parallelograms; ++g) {
      for (const uint32_t of : {parallelograms[g].a, parallelograms[g].b}) {
        if (of == focus || of == last) return g;
      }
    }
    return 0;
  }
  static uint8_t kind_of(unsigned place, bool swapped, bool late) {
    return static_cast<uint8_t>(place * 2 * valence_classes + 2 * unsigned{swapped} + unsigned{late});
  }

  const CornerFaces& faces_;
  std::span<const uint32_t> element_;
  std::vector<Around> around_;
  std::vector<uint32_t> straight_;  ///< corners of larger faces that know one neighbour
  FanSurface result_;
};

}  // namespace

CornerFaces corner_faces(const FanSurface& fans) {
  CornerFaces faces;
  faces.points = fans.corners;
  faces.offsets = fans.offsets;
  faces.point_count = fans.vertices;
  link_corners(faces);
  glue_corners(faces);
  return faces;
}

void CornerFaces::flip(const std::vector<bool>& flipped) {
  number.resize(corners());
  for (uint32_t f = 0; f < faces(); ++f) {
    const uint32_t begin = first(f), degree = first(f + 1) - begin;
    for (uint32_t k = 0; k < degree; ++k) number[begin + k] = begin + (flipped[f] && k > 0 ? degree - k : k);
  }
}

CornerFaces corner_faces(const PatchSurface& surface) {
  const HalfEdges& edges = surface.half_edges;
  CornerFaces faces;
  faces.point_count = surface.point_count;
  if (!edges.all_triangles()) faces.offsets.push_back(0);
  std::vector<uint32_t> corner_of(edges.size(), none);
  for (uint32_t f = 0; f < surface.face_count; ++f) {
    // Both sides have the faces in the same order, but not their first corners.
    const uint32_t first = lowest_corner_of(surface, f);
    uint32_t h = first;
    do {
      corner_of[h] = faces.corners();
      faces.points.push_back(surface.point(edges.origin[h]));
      faces.number.push_back(h);
      h = edges.next(h);
    } while (h != first);
    if (!faces.offsets.empty()) faces.offsets.push_back(faces.corners());
  }
  link_corners(faces);
  for (const uint32_t h : faces.number) faces.opposite.push_back(corner_of[edges.opposite[h]]);
  return faces;
}

FanSurface element_references(const CornerFaces& faces, std::span<const uint32_t> element, uint32_t count) {
  return ReferenceFinder(faces, element, count).run();
}

/// A cell is expected as its newest neighbour before it is, or, where that pays, as fitted rows say of the
/// three newest.
FanSurface face_references(const CornerFaces& faces) {
  const uint32_t count = faces.faces();
  std::vector<uint32_t> face_of(faces.corners());
  for (uint32_t f = 0; f < count; ++f)
    std::fill(face_of.begin() + faces.first(f), face_of.begin() + faces.first(f + 1), f);
  FanSurface result;
  result.vertices = count;
  result.valences.resize(count);
  result.references.resize(count);
  result.kinds.resize(count);
  for (uint32_t f = 0; f < count; ++f) {
    // The neighbours before it, the newest first.
    std::array<uint32_t, 3> known{none, none, none};
    for (uint32_t c = faces.first(f); c < faces.first(f + 1); ++c) {
      const uint32_t other = faces.opposite[c] == none ? none : face_of[faces.opposite[c]];
      if (other >= f) continue;
      uint32_t left = other;
      // Three newest neighbours, sorted by insertion; a neighbour across two edges counts once.
      for (uint32_t& at : known) {
        if (at == left) break;
        if (at == none || left > at) std::swap(at, left);
        if (left == none) break;
      }
    }
    R& references = result.references[f];
    references.at.fill(known[0] != none ? known[0] : f > 0 ? f - 1 : 0);
    unsigned place = start_place;
    if (known[1] != none) {
      references.at.fill(known[1]);
      references.at[R::last] = known[0];
      place = edge_place;
      if (known[2] != none) references.at[R::next] = references.at[R::next_opposite] = known[2];
    }
    result.kinds[f] = static_cast<uint8_t>(place * 2 * valence_classes);
  }
  return result;
}

}  // namespace maille
