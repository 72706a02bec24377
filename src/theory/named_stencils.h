#pragma once

#include <maille/predict.h>

#include <string_view>

// Stencils by name. Edges have length 1.
namespace maille {

/// How far the tips of a K-star, the vertices across the edges of a vertex's ring, lie from its centre, the
/// ring's radius being 1.
enum class Tips : uint8_t {
  reflected,    ///< each is the centre, reflected in the middle of its edge: parallelograms
  equilateral,  ///< each makes an equilateral triangle with its edge
};
double tip_distance(unsigned valence, Tips tips);

/// a, b, across: the triangle on the edge ab, whose other triangle's tip is wanted.
Stencil parallelogram_stencil();
/// Three corners of a quad, in order; the fourth is wanted.
Stencil quad_stencil();
/// A vertex of a fan of `valence` triangles (3 or more): its centre, its two neighbours in the fan, and those
/// next to them, as far as there are any.
Stencil dual_parallelogram_stencil(unsigned valence);
/// The centre of a ring of `valence` vertices (3 to 16), from the ring and its tips, which lie `tips` from
/// the centre. docs/prediction.md, "The K-star".
Stencil k_star_stencil(unsigned valence, double tips);
/// Corner `known` of a regular polygon of `degree` corners (3 to 16), from those before it.
Stencil polygon_stencil(unsigned degree, unsigned known);
/// Across the edge 0-1 of a known polygon: the new corner number `known` of one with `degree` corners,
/// counted from the one next to corner 0.
Stencil polygon_beside_stencil(unsigned known_degree, unsigned degree, unsigned known);
/// Lattice points: '#' known, 'x' wanted, '.' neither; '/' begins a row, '|' a layer. Error: usage, for other
/// characters and pictures without an x.
Result<Stencil> grid_stencil(std::string_view picture);
/// The middle of an edge from 8 vertices, or from 10 with the two farther along the edge.
Stencil butterfly_stencil(unsigned points);
/// The middle of an edge from the ring of one of its ends.
Stencil modified_butterfly_stencil(unsigned valence);
/// The middle of a triangle from 6 vertices (corners and tips) or 12 (the triangles beside the tips, too).
Stencil sqrt3_stencil(unsigned points);
/// The middle of a triangle from one of its corners and that corner's ring.
Stencil sqrt3_ring_stencil(unsigned valence);
/// Corner 0 of a cube from the corners in `mask`: bit i for corner i, whose coordinates are the bits of i.
Stencil cube_stencil(unsigned mask);
/// A hexahedron on a face (z = 0) of a known one: its new corner number `known` (0 to 3), in the order 001
/// 101 111 011, from eight corners of the known one and the new ones before.
Stencil hexahedron_stencil(unsigned known);

}  // namespace maille
