#include "surface/arrays/stencil.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "support/half_edges.h"
#include "support/random_mesh.h"
#include "surface/patch_topology.h"

namespace maille::testing {
namespace {

EncodedTopology encode(const Mesh& mesh) {
  auto encoded = encode_topology(mesh);
  EXPECT_TRUE(encoded) << encoded.error().message;
  return encoded ? std::move(*encoded) : EncodedTopology{};
}

ElementStencil stencil_of(const PatchSurface& surface, uint32_t vertex) {
  ElementStencil stencil{};
  find_point_stencil(surface, vertex, stencil);
  return stencil;
}

TEST(PointStencil, OfATetrahedronGrowsAsItsPointsBecomeKnown) {
  const EncodedTopology encoded = encode(tetrahedron());
  const PatchSurface& surface = encoded.topology.surface;
  EXPECT_EQ(stencil_of(surface, 0).parallelogram_count, 0u);
  EXPECT_EQ(stencil_of(surface, 0).neighbour, none);
  EXPECT_EQ(stencil_of(surface, 1).parallelogram_count, 0u);
  EXPECT_EQ(stencil_of(surface, 1).neighbour, 0u);
  EXPECT_EQ(stencil_of(surface, 2).parallelogram_count, 0u);
  EXPECT_NE(stencil_of(surface, 2).neighbour, none);
  // Each face at the last point has the same face behind it.
  const ElementStencil last = stencil_of(surface, 3);
  ASSERT_EQ(last.parallelogram_count, 3u);
  std::set<uint32_t> across;
  for (unsigned i = 0; i < 3; ++i) {
    const Parallelogram& parallelogram = last.parallelograms[i];
    EXPECT_EQ((std::set<uint32_t>{parallelogram.a, parallelogram.b, parallelogram.across}),
              (std::set<uint32_t>{0, 1, 2}));
    across.insert(parallelogram.across);
  }
  EXPECT_EQ(across.size(), 3u);
}

/// Coordinates of a coded point.
std::array<double, 3> position(const Mesh& mesh, const EncodedTopology& encoded, uint32_t point) {
  const float* at = mesh.points.values<float>().data() + size_t{3} * encoded.sources.points[point];
  return {double{at[0]}, double{at[1]}, double{at[2]}};
}

/// Parallelograms that predict a point exactly, of all parallelograms.
std::pair<size_t, size_t> exact_parallelograms(const Mesh& mesh) {
  const EncodedTopology encoded = encode(mesh);
  const PatchSurface& surface = encoded.topology.surface;
  std::pair<size_t, size_t> count{0, 0};
  for (uint32_t vertex = 0; vertex < surface.vertices.size(); ++vertex) {
    const ElementStencil stencil = stencil_of(surface, vertex);
    const auto here = position(mesh, encoded, surface.point(vertex));
    for (unsigned i = 0; i < stencil.parallelogram_count; ++i) {
      const Parallelogram& parallelogram = stencil.parallelograms[i];
      const auto a = position(mesh, encoded, parallelogram.a), b = position(mesh, encoded, parallelogram.b),
                 across = position(mesh, encoded, parallelogram.across);
      bool exact = true;
      for (size_t k = 0; k < 3; ++k) exact = exact && a[k] + b[k] - across[k] == here[k];
      count.first += exact;
      ++count.second;
    }
  }
  return count;
}

Surface flat_lattice(bool triangles) {
  Surface surface = shapes::grid(12, 9);
  for (auto& point : surface.points) point = {3 * point[0] + point[1], 2 * point[1] - point[0], point[0]};
  if (!triangles) return surface;
  const auto quads = std::move(surface.faces);
  surface.faces.clear();
  for (const auto& quad : quads) {
    surface.faces.push_back({quad[0], quad[1], quad[2]});
    surface.faces.push_back({quad[0], quad[2], quad[3]});
  }
  return surface;
}

TEST(PointStencil, EveryParallelogramIsExactOnFlatLattices) {
  for (const bool triangles : {false, true}) {
    const auto [exact, all] = exact_parallelograms(to_mesh(flat_lattice(triangles)));
    EXPECT_EQ(exact, all) << triangles;
    EXPECT_GT(all, 100u) << triangles;
  }
}

TEST(PointStencil, TakesTheOtherCornersOfItsOwnFaces) {
  // The last corner of a cube has three quads whose other corners are known; each of them predicts it.
  const Mesh mesh = cube();
  const EncodedTopology encoded = encode(mesh);
  const ElementStencil last = stencil_of(encoded.topology.surface, 7);
  EXPECT_EQ(last.parallelogram_count, 3u);
  const auto here = position(mesh, encoded, 7);
  for (unsigned i = 0; i < last.parallelogram_count; ++i) {
    const Parallelogram& parallelogram = last.parallelograms[i];
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(position(mesh, encoded, parallelogram.a)[k] + position(mesh, encoded, parallelogram.b)[k] -
                    position(mesh, encoded, parallelogram.across)[k],
                here[k]);
    }
  }
}

TEST(PointStencil, HoldsKnownPointsOnlyAndFewParallelograms) {
  RandomMeshOptions options;
  options.arrays = false;
  for (uint64_t seed = 0; seed < 600; ++seed) {
    const EncodedTopology encoded = encode(random_surface(seed, options));
    const PatchSurface& surface = encoded.topology.surface;
    uint32_t known = 0;  // points of vertices before
    for (uint32_t vertex = 0; vertex < surface.vertices.size(); ++vertex) {
      const ElementStencil stencil = stencil_of(surface, vertex);
      ASSERT_LE(stencil.parallelogram_count, ElementStencil::most_parallelograms);
      for (unsigned i = 0; i < stencil.parallelogram_count; ++i) {
        for (const uint32_t point :
             {stencil.parallelograms[i].a, stencil.parallelograms[i].b, stencil.parallelograms[i].across}) {
          ASSERT_LT(point, known) << seed;
        }
      }
      ASSERT_TRUE(stencil.neighbour == none || stencil.neighbour < known) << seed;
      ASSERT_TRUE(stencil.parallelogram_count == 0 || stencil.neighbour != none) << seed;
      known = std::max(known, surface.point(vertex) + 1);
    }
  }
}

}  // namespace
}  // namespace maille::testing
