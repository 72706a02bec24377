#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>
#include <vector>

namespace maille::testing {

/// Points and polygons, the simplest form to build and to mutilate.
struct Surface {
  std::vector<std::array<double, 3>> points;
  std::vector<std::vector<uint32_t>> faces;
};

/// Appends a copy of `part`, moved by `offset`, without shared points.
void append(Surface& surface, const Surface& part, std::array<double, 3> offset = {0, 0, 0});
/// Every face as a fan of triangles round its first corner.
Surface triangulated(const Surface& surface);
/// One polygon block, positions of the given type (rounded for integers).
Mesh to_mesh(const Surface& surface, Scalar type = Scalar::f32);

/// Surfaces by name; orientation is consistent (outwards) wherever the surface allows one.
namespace shapes {
Surface tetrahedron();
Surface cube();  ///< six quads
/// n x m quads over (n + 1)(m + 1) points, slightly curved.
Surface grid(uint32_t n, uint32_t m);
/// n x m quads; both at least 3 for a proper one, smaller ones touch themselves.
Surface torus(uint32_t n, uint32_t m);
/// `slices` x `stacks`, triangles at the poles, quads between them.
Surface sphere(uint32_t slices, uint32_t stacks);
Surface moebius(uint32_t n, uint32_t m);
Surface klein_bottle(uint32_t n, uint32_t m);
/// A ring of n x m quads with two boundary loops.
Surface cylinder(uint32_t n, uint32_t m);
/// n triangles round one point, closed or open.
Surface fan(uint32_t n, bool closed);
/// n faces on one edge.
Surface book(uint32_t n);
/// The boundary of a set of voxels (x fastest), points shared: non-manifold edges and points where voxels
/// touch diagonally.
Surface voxels(const std::vector<bool>& set, uint32_t nx, uint32_t ny, uint32_t nz);
/// A plate with `genus` holes.
Surface plate(uint32_t genus);
}  // namespace shapes

Mesh tetrahedron();
Mesh cube();
Mesh torus(uint32_t n, uint32_t m);
Mesh grid(uint32_t n, uint32_t m);
Mesh sphere(uint32_t slices, uint32_t stacks);
Mesh moebius(uint32_t n, uint32_t m);

}  // namespace maille::testing
