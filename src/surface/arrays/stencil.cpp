#include "surface/arrays/stencil.h"

namespace maille {
namespace {

/// Point of the vertex at the origin of h when it is known before `vertex`; none otherwise.
uint32_t known_point(const PatchSurface& surface, uint32_t h, uint32_t vertex) {
  const uint32_t other = surface.half_edges.origin[h];
  return other < vertex ? surface.point(other) : none;
}

/// Those beyond the fifth do not count, as the format says (13.3).
void add_parallelogram(ElementStencil& stencil, uint32_t a, uint32_t b, uint32_t across) {
  if (across == none || stencil.parallelogram_count == ElementStencil::most_parallelograms) return;
  stencil.parallelograms[stencil.parallelogram_count++] = {a, b, across};
}

/// Gates of one corner: `next` and `previous` are the known points beside it in its face, h its half-edge.
void find_parallelograms_at(const PatchSurface& surface, uint32_t vertex, uint32_t h,
                            ElementStencil& stencil) {
  const HalfEdges& edges = surface.half_edges;
  const uint32_t next_edge = edges.next(h);
  const uint32_t previous_edge = edges.previous(h);
  const uint32_t next = known_point(surface, next_edge, vertex);
  const uint32_t previous = known_point(surface, previous_edge, vertex);
  if (next != none) stencil.neighbour = next;
  if (previous != none) stencil.neighbour = previous;
  const uint32_t beyond_next = edges.next(next_edge);
  if (beyond_next == previous_edge) {
    if (next == none || previous == none) return;
    // A triangle among polygons: across the edge opposite to the vertex.
    const uint32_t over = edges.opposite[next_edge];
    return add_parallelogram(stencil, next, previous, known_point(surface, edges.previous(over), vertex));
  }
  if (next != none && previous != none) {
    return add_parallelogram(stencil, next, previous, known_point(surface, beyond_next, vertex));
  }
  // A polygon with one known edge at the vertex's neighbour: continue the neighbouring face over that edge.
  if (next != none && known_point(surface, beyond_next, vertex) != none) {
    const uint32_t over = edges.opposite[next_edge];
    const uint32_t across = known_point(surface, edges.next(edges.next(over)), vertex);
    return add_parallelogram(stencil, next, next, across);
  }
  if (previous != none && known_point(surface, edges.previous(previous_edge), vertex) != none) {
    const uint32_t over = edges.opposite[edges.previous(previous_edge)];
    const uint32_t across = known_point(surface, edges.previous(over), vertex);
    return add_parallelogram(stencil, previous, previous, across);
  }
}

/// The same for surfaces of triangles, where each face round the vertex has one parallelogram at most. Which
/// neighbours are known is as good as random, so nothing branches on it: a parallelogram that is not there is
/// overwritten by the next one.
template <bool WithPoints>
void find_triangle_stencil(const PatchSurface& surface, uint32_t vertex, ElementStencil& stencil) {
  const uint32_t* const origin = surface.half_edges.origin.data();
  const uint32_t* const opposite = surface.half_edges.opposite.data();
  const auto point_before = [&](uint32_t h) {
    const uint32_t other = origin[h];
    // Dummies have no entry in point_of, so an index that is there is read for what is not known.
    const uint32_t point = WithPoints ? surface.point_of[other < vertex ? other : vertex] : other;
    return other < vertex ? point : none;
  };
  const uint32_t corner = surface.vertices.corner[vertex];
  uint32_t h = corner;
  uint32_t place = h % 3;
  uint32_t next = point_before(place == 2 ? h - 2 : h + 1);
  uint32_t neighbour = none;
  unsigned count = 0;
  do {
    const uint32_t next_edge = place == 2 ? h - 2 : h + 1;
    const uint32_t previous_edge = place == 0 ? h + 2 : h - 1;
    const uint32_t previous = point_before(previous_edge);
    const uint32_t over = opposite[next_edge];
    const uint32_t across = point_before(over % 3 == 0 ? over + 2 : over - 1);
    // Written before it is known whether it counts: ElementStencil has one to spare.
    stencil.parallelograms[count] = {next, previous, across};
    const auto known = static_cast<unsigned>((next != none) & (previous != none) & (across != none));
    count += known & static_cast<unsigned>(count < ElementStencil::most_parallelograms);
    neighbour = previous != none ? previous : neighbour;
    next = previous;  // the faces round the vertex share their edges
    h = opposite[previous_edge];
    place = h % 3;
  } while (h != corner);
  stencil.parallelogram_count = count;
  stencil.neighbour = neighbour;
}

}  // namespace

void find_point_stencil(const PatchSurface& surface, uint32_t vertex, ElementStencil& stencil) {
  stencil.parallelogram_count = 0;
  stencil.neighbour = none;
  if (surface.half_edges.all_triangles()) {
    if (surface.point_of.empty()) return find_triangle_stencil<false>(surface, vertex, stencil);
    return find_triangle_stencil<true>(surface, vertex, stencil);
  }
  const uint32_t corner = surface.vertices.corner[vertex];
  uint32_t h = corner;
  do {
    find_parallelograms_at(surface, vertex, h, stencil);
    h = surface.half_edges.turn(h);
  } while (h != corner);
}

}  // namespace maille
