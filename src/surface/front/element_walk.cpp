#include "surface/front/element_walk.h"

namespace maille {

std::vector<uint32_t> faces_of_half_edges(const PatchSurface& surface, Domain domain) {
  std::vector<uint32_t> face_of;
  if (domain != Domain::cell && domain != Domain::corner) return face_of;
  face_of.assign(surface.half_edges.size(), none);
  for (uint32_t face = 0; face < surface.face_count; ++face) {
    uint32_t h = surface.face(face);
    do {
      face_of[h] = face;
      h = surface.half_edges.next(h);
    } while (h != surface.face(face));
  }
  return face_of;
}

uint32_t ElementWalk::lowest_corner(uint32_t face) const {
  return lowest_corner_of(surface_, face);
}

/// No vertex is twice in a face, so the lowest is one corner.
uint32_t lowest_corner_of(const PatchSurface& surface, uint32_t face) {
  const HalfEdges& edges = surface.half_edges;
  uint32_t lowest = surface.face(face);
  for (uint32_t h = edges.next(lowest); h != surface.face(face); h = edges.next(h)) {
    if (edges.origin[h] < edges.origin[lowest]) lowest = h;
  }
  return lowest;
}

void ElementWalk::find_ring(uint32_t vertex) {
  ring_.clear();
  adjacent_.clear();
  const uint32_t first = surface_.vertices.corner[vertex];
  uint32_t h = first;
  do {
    const uint32_t after = surface_.half_edges.turn(h);
    if (is_real(h)) {
      ring_.push_back(h);
      adjacent_.push_back(is_real(after));
    }
    h = after;
  } while (h != first);
}

CornerPair ElementWalk::pair_at(size_t i, uint32_t vertex) const {
  const HalfEdges& edges = surface_.half_edges;
  const uint32_t next = ring_[i + 1 < ring_.size() ? i + 1 : 0];
  CornerPair pair{ring_[i], next, edges.previous(ring_[i]), edges.next(next)};
  // Corners of vertices to come, and dummies, whose numbers are higher than all vertices', are not known yet.
  if (edges.origin[pair.far_corner] >= vertex) pair.far_corner = pair.far_next = none;
  return pair;
}

}  // namespace maille
