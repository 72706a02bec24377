#pragma once

#include <cstdint>
#include <vector>

#include "surface/arrays/array_coder.h"
#include "surface/arrays/stencil.h"

namespace maille {

/// Number of the real face of each half-edge; none in border triangles. Points do without.
std::vector<uint32_t> faces_of_half_edges(const PatchSurface& surface, Domain domain);

/// The corner of a face at its lowest vertex: corners of a face start elsewhere for the encoder.
uint32_t lowest_corner_of(const PatchSurface& surface, uint32_t face);

/// Corners of one vertex that hold the same tuple, side by side around it: coded as one element.
struct Wedge {
  std::vector<uint32_t> corners;  ///< half-edges in their order around the vertex; the first is the element
};

/// Two corners of one vertex beside each other, in the faces on both sides of an edge, which `next` starts.
struct CornerPair {
  uint32_t corner;
  uint32_t next;
  uint32_t far_corner;  ///< at the edge's other end, in the face of `corner`, when known; else none
  uint32_t far_next;    ///< the same in the face of `next`
};

/// Visits the elements of a domain in coded order with their stencils: what both directions share. Normals
/// and twins still go this way; other arrays have references by faces (corner_faces.h). The order of corners
/// is that of vertices, around each from corner(V) on: half-edges are numbered differently on the two sides,
/// so their numbers give no order.
class ElementWalk {
 public:
  ElementWalk(const PatchElements& elements, const std::vector<uint32_t>& face_of)
      : elements_(elements), surface_(*elements.surface), face_of_(face_of) {}

  /// Corners one by one, without stencils. `visit` returns false to stop.
  template <class Visit>
  void run(Domain domain, uint64_t mesh_tuples, Visit visit) {
    switch (domain) {
      case Domain::point:
        return points(visit);
      case Domain::cell:
        return cells(visit);
      case Domain::corner:
        return corners(visit);
      case Domain::mesh:
        return rest(0, static_cast<uint32_t>(mesh_tuples), visit);
    }
  }

  /// Corners wedge by wedge: `same(a, b)` tells if two known corners hold the same tuple, `code_joined` codes
  /// if a pair of corners does, `visit` gets a wedge, or no corners and the number of a loose one.
  template <class Same, class CodeJoined, class Visit>
  void run_wedges(Same same, CodeJoined code_joined, Visit visit) {
    Wedge wedge;
    for (uint32_t vertex = 0; vertex < surface_.vertices.size(); ++vertex) {
      find_ring(vertex);
      const size_t size = ring_.size();
      const size_t first = code_joints(vertex, code_joined);
      const auto place = [&](size_t i) { return first + i < size ? first + i : first + i - size; };
      uint32_t before = none;
      for (size_t i = 0; i < size;) {
        wedge.corners.clear();
        do {
          wedge.corners.push_back(ring_[place(i)]);
        } while (joined_[place(i)] && ++i < size);
        if (i < size) ++i;
        find_wedge_stencil(wedge, vertex, before, same);
        before = wedge.corners.front();
        if (!visit(before, stencil_, wedge)) return;
      }
    }
    wedge.corners.clear();
    rest(surface_.half_edges.size(), elements_.corners(),
         [&](uint32_t corner, const ElementStencil& stencil) { return visit(corner, stencil, wedge); });
  }

 private:
  /// Elements that are not on the surface have no neighbours.
  template <class Visit>
  void rest(uint32_t from, uint32_t to, Visit visit) {
    const ElementStencil nothing{};
    for (uint32_t i = from; i < to; ++i) {
      if (!visit(i, nothing)) return;
    }
  }

  template <class Visit>
  void points(Visit visit) {
    uint32_t next = 0;
    for (uint32_t vertex = 0; vertex < surface_.vertices.size(); ++vertex) {
      if (surface_.point(vertex) != next) continue;  // another fan of a point before
      find_point_stencil(surface_, vertex, stencil_);
      if (!visit(next++, stencil_)) return;
    }
    rest(surface_.point_count, elements_.points, visit);
  }

  /// Each known neighbour of a face is a parallelogram of its own, of no size.
  template <class Visit>
  void cells(Visit visit) {
    const uint32_t faces = surface_.face_count;
    for (uint32_t face = 0; face < faces; ++face) {
      stencil_.parallelogram_count = 0;
      stencil_.neighbour = none;
      // From the corner of the lowest vertex, which is the same on both sides.
      const uint32_t first = lowest_corner(face);
      uint32_t h = first;
      do {
        const uint32_t other = face_of_[surface_.half_edges.opposite[h]];
        if (other < face) {
          add_parallelogram(other, other, other);
          if (stencil_.neighbour == none || other > stencil_.neighbour) stencil_.neighbour = other;
        }
        h = surface_.half_edges.next(h);
      } while (h != first);
      if (!visit(face, stencil_)) return;
    }
    rest(faces, elements_.cells(), visit);
  }

  template <class Visit>
  void corners(Visit visit) {
    const ElementStencil nothing{};
    for (uint32_t vertex = 0; vertex < surface_.vertices.size(); ++vertex) {
      const uint32_t first = surface_.vertices.corner[vertex];
      uint32_t h = first;
      do {
        if (is_real(h) && !visit(h, nothing)) return;
        h = surface_.half_edges.turn(h);
      } while (h != first);
    }
    rest(surface_.half_edges.size(), elements_.corners(), visit);
  }

  uint32_t lowest_corner(uint32_t face) const;
  bool is_real(uint32_t h) const { return face_of_[h] != none; }
  /// The corner at half-edge h when its vertex came before `vertex`; none otherwise.
  uint32_t known_corner(uint32_t h, uint32_t vertex) const {
    return is_real(h) && surface_.half_edges.origin[h] < vertex ? h : none;
  }
  void add_parallelogram(uint32_t a, uint32_t b, uint32_t across) {
    if (stencil_.parallelogram_count < ElementStencil::most_parallelograms)
      stencil_.parallelograms[stencil_.parallelogram_count++] = {a, b, across};
  }

  /// The real corners of a vertex, and which of them follow each other across an edge.
  void find_ring(uint32_t vertex);
  CornerPair pair_at(size_t i, uint32_t vertex) const;

  /// Codes joined_; returns where the first wedge starts. A ring that is closed has no cut, or two and more.
  /// So the last pair follows from the others, unless two of them or more are cut: one cut alone would be
  /// none.
  template <class CodeJoined>
  size_t code_joints(uint32_t vertex, CodeJoined code_joined) {
    const size_t size = ring_.size();
    joined_.assign(size, 0);
    unsigned cuts = 0;
    size_t after_cut = 0;
    for (size_t i = 0; i < size; ++i) {
      const bool closing = i + 1 == size;
      if (adjacent_[i] && !(closing && cuts < 2)) joined_[i] = code_joined(pair_at(i, vertex));
      if (joined_[i] || closing) continue;
      cuts += adjacent_[i] ? 1 : 2;
      after_cut = i + 1;
    }
    return size > 0 && joined_[size - 1] ? after_cut : 0;
  }

  /// From all faces of the wedge; a wedge that nothing is known of has the one before at its vertex for a
  /// neighbour.
  template <class Same>
  void find_wedge_stencil(const Wedge& wedge, uint32_t vertex, uint32_t before, Same same) {
    stencil_.parallelogram_count = 0;
    stencil_.neighbour = none;
    for (const uint32_t h : wedge.corners) find_parallelogram_at(h, vertex, same);
    if (stencil_.neighbour == none) stencil_.neighbour = before;
  }

  template <class Same>
  void find_parallelogram_at(uint32_t h, uint32_t vertex, Same same) {
    const HalfEdges& edges = surface_.half_edges;
    const uint32_t next = edges.next(h);
    const uint32_t previous = edges.previous(h);
    const uint32_t a = known_corner(next, vertex);
    const uint32_t b = known_corner(previous, vertex);
    if (a != none) stencil_.neighbour = a;
    if (b != none) stencil_.neighbour = b;
    const uint32_t beyond = edges.next(next);
    if (beyond == previous) {
      if (a == none || b == none) return;
      const uint32_t over = edges.opposite[next];  // from b's vertex to a's
      const uint32_t across = known_corner(edges.previous(over), vertex);
      if (across != none && same(over, b) && same(edges.next(over), a)) add_parallelogram(a, b, across);
      return;
    }
    if (a != none && b != none) {
      if (known_corner(beyond, vertex) != none) add_parallelogram(a, b, beyond);
    } else if (a != none && known_corner(beyond, vertex) != none) {
      const uint32_t over = edges.opposite[next];  // from `beyond`'s vertex to a's
      const uint32_t across = known_corner(edges.next(edges.next(over)), vertex);
      if (across != none && same(edges.next(over), a)) add_parallelogram(a, a, across);
    } else if (b != none && known_corner(edges.previous(previous), vertex) != none) {
      const uint32_t over = edges.opposite[edges.previous(previous)];  // from b's vertex on
      const uint32_t across = known_corner(edges.previous(over), vertex);
      if (across != none && same(over, b)) add_parallelogram(b, b, across);
    }
  }

  const PatchElements& elements_;
  const PatchSurface& surface_;
  const std::vector<uint32_t>& face_of_;
  ElementStencil stencil_;
  // Of the vertex at hand: real corners, whether the next one lies across an edge, whether it joins the
  // wedge.
  std::vector<uint32_t> ring_;
  std::vector<uint8_t> adjacent_, joined_;  // flags: bits would take longer
};

}  // namespace maille
