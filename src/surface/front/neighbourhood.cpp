#include "surface/front/neighbourhood.h"

namespace maille {
namespace {

/// One turn around the vertex, from corner(V) on, which both sides have; what is known are vertices before
/// it.
class Search {
 public:
  Search(const PatchSurface& surface, uint32_t vertex, Neighbourhood& found)
      : surface_(surface), edges_(surface.half_edges), vertex_(vertex), found_(found) {}

  void run() {
    found_.parallelogram_count = found_.ring_count = found_.valence = 0;
    found_.border = false;
    const uint32_t first = surface_.vertices.corner[vertex_];
    uint32_t h = first;
    do {
      look_at(h);
      h = edges_.turn(h);
    } while (h != first);
  }

 private:
  uint32_t known(uint32_t h) const {
    const uint32_t other = edges_.origin[h];
    return other < vertex_ ? surface_.point(other) : none;
  }
  void add_parallelogram(uint32_t a, uint32_t b, uint32_t across) {
    if (across == none || found_.parallelogram_count == Neighbourhood::most_parallelograms) return;
    found_.parallelograms[found_.parallelogram_count++] = {a, b, across, none, none};
  }

  void look_at(uint32_t h) {
    const uint32_t next_edge = edges_.next(h);
    const uint32_t previous_edge = edges_.previous(h);
    const uint32_t next = known(next_edge);
    const uint32_t previous = known(previous_edge);
    ++found_.valence;
    found_.border |= edges_.origin[next_edge] >= first_dummy;
    if (next != none && found_.ring_count < Neighbourhood::most_ring) {
      const uint32_t behind = edges_.opposite[h];
      const bool end = previous == none || known(edges_.previous(behind)) == none;
      found_.arc_end[found_.ring_count] = end;
      found_.ring[found_.ring_count++] = next;
    }
    const uint32_t beyond_next = edges_.next(next_edge);
    if (beyond_next == previous_edge) return look_across(next_edge, next, previous);
    if (next != none && previous != none) return add_parallelogram(next, previous, known(beyond_next));
    if (next != none && known(beyond_next) != none) {
      return add_parallelogram(next, next, known(edges_.next(edges_.next(edges_.opposite[next_edge]))));
    }
    if (previous != none && known(edges_.previous(previous_edge)) != none) {
      add_parallelogram(previous, previous,
                        known(edges_.previous(edges_.opposite[edges_.previous(previous_edge)])));
    }
  }

  /// The parallelogram of a triangle, over the edge from a to b.
  void look_across(uint32_t edge, uint32_t a, uint32_t b) {
    if (a == none || b == none) return;
    const uint32_t over = edges_.opposite[edge];
    const uint32_t count = found_.parallelogram_count;
    add_parallelogram(a, b, known(edges_.previous(over)));
    if (count == found_.parallelogram_count || edges_.next(edges_.next(edges_.next(over))) != over) return;
    found_.parallelograms[count].tip_a = known(edges_.previous(edges_.opposite[edges_.next(over)]));
    found_.parallelograms[count].tip_b = known(edges_.previous(edges_.opposite[edges_.previous(over)]));
  }

  const PatchSurface& surface_;
  const HalfEdges& edges_;
  uint32_t vertex_;
  Neighbourhood& found_;
};

}  // namespace

void find_neighbourhood(const PatchSurface& surface, uint32_t vertex, Neighbourhood& found) {
  Search(surface, vertex, found).run();
}

}  // namespace maille
