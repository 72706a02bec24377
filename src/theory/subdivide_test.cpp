#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <maille/subdivide.h>

#include <cmath>

#include "support/pathologies.h"
#include "support/random.h"
#include "support/shapes.h"
#include "theory/butterfly_block.h"
#include "theory/sqrt3_block.h"
#include "theory/subdivision_point.h"
#include "theory/testing.h"

namespace maille::testing {
namespace {

using ::testing::HasSubstr;

constexpr SubdivisionScheme both[] = {SubdivisionScheme::butterfly, SubdivisionScheme::sqrt3};

/// Keeps what it is given, and checks the order of calls.
class Collected final : public SubdivisionOutput {
 public:
  Result<> begin(uint64_t points, uint64_t triangles) override {
    EXPECT_EQ(begun++, 0);
    point_count = points;
    triangle_count = triangles;
    return {};
  }
  Result<> points(std::span<const double> coordinates) override {
    EXPECT_TRUE(surface.corners.empty());
    for (size_t i = 0; i < coordinates.size(); i += 3) {
      surface.points.push_back({coordinates[i], coordinates[i + 1], coordinates[i + 2]});
    }
    return {};
  }
  Result<> triangles(std::span<const uint32_t> corners) override {
    surface.corners.insert(surface.corners.end(), corners.begin(), corners.end());
    return {};
  }
  int begun = 0;
  uint64_t point_count = 0;
  uint64_t triangle_count = 0;
  TriangleSurface surface;
};

/// The result, of which all that must be true is checked: counts, indices, neighbours.
TriangleSurface subdivided(const Mesh& mesh, SubdivisionScheme scheme, unsigned levels) {
  Collected out;
  const auto result = subdivide(mesh, {scheme, levels}, out);
  EXPECT_TRUE(result) << result.error().message;
  EXPECT_EQ(out.surface.points.size(), out.point_count);
  EXPECT_EQ(out.surface.triangles(), out.triangle_count);
  const auto found = find_opposites(out.surface);
  EXPECT_TRUE(found) << found.error().message;
  return out.surface;
}

size_t border_edges(const TriangleSurface& surface) {
  return static_cast<size_t>(
      std::count(surface.opposite.begin(), surface.opposite.end(), TriangleSurface::border));
}

int64_t euler_characteristic(const TriangleSurface& surface) {
  const auto edges = (surface.half_edges() + border_edges(surface)) / 2;
  return static_cast<int64_t>(surface.points.size()) - static_cast<int64_t>(edges) + surface.triangles();
}

Mesh mesh_of(const Surface& surface) {
  return to_mesh(triangulated(surface), Scalar::f64);
}

struct Shape {
  const char* name;
  Surface surface;
};

std::vector<Shape> all_shapes() {
  return {{"tetrahedron", shapes::tetrahedron()},
          {"cube", shapes::cube()},
          {"grid", shapes::grid(5, 4)},
          {"torus", shapes::torus(7, 5)},
          {"sphere", shapes::sphere(9, 6)},
          {"cylinder", shapes::cylinder(6, 2)},
          {"fan", shapes::fan(5, false)},
          {"triangle", shapes::fan(1, false)},
          {"plate", shapes::plate(2)}};
}

TEST(Subdivide, KeepsTopologyAndPointsOfEveryShape) {
  for (const Shape& shape : all_shapes()) {
    const Mesh mesh = mesh_of(shape.surface);
    const TriangleSurface coarse = *triangle_surface(mesh);
    for (const SubdivisionScheme scheme : both) {
      for (unsigned levels = 1; levels <= 4; ++levels) {
        SCOPED_TRACE(shape.name + std::to_string(levels));
        const TriangleSurface fine = subdivided(mesh, scheme, levels);
        const bool butterfly = scheme == SubdivisionScheme::butterfly;
        EXPECT_EQ(fine.triangles(), coarse.triangles() * std::pow(butterfly ? 4 : 3, levels));
        const size_t parts = butterfly ? size_t{1} << levels : levels < 2 ? 1 : levels < 4 ? 3 : 9;
        EXPECT_EQ(border_edges(fine), parts * border_edges(coarse));
        EXPECT_EQ(euler_characteristic(fine), euler_characteristic(coarse));
        for (size_t i = 0; i < coarse.points.size(); ++i) EXPECT_EQ(fine.points[i], coarse.points[i]);
      }
    }
  }
}

TEST(Subdivide, ReproducesPlanesUpToTheBorder) {
  Surface flat = triangulated(shapes::grid(5, 4));
  for (auto& p : flat.points) p[2] = 2 * p[0] - 3 * p[1] + 1;
  for (const SubdivisionScheme scheme : both) {
    for (const Position& p : subdivided(to_mesh(flat, Scalar::f64), scheme, 3).points) {
      EXPECT_NEAR(p[2], 2 * p[0] - 3 * p[1] + 1, 1e-12);
    }
  }
}

/// Points of the triangular lattice, n to a side, under a function.
template <class Height>
Surface lattice(uint32_t n, Height height) {
  Surface surface;
  for (uint32_t j = 0; j < n; ++j) {
    for (uint32_t i = 0; i < n; ++i) {
      const double u = i + j / 2.0, v = j * std::sqrt(0.75);
      surface.points.push_back({u, v, height(u, v)});
    }
  }
  for (uint32_t j = 0; j + 1 < n; ++j) {
    for (uint32_t i = 0; i + 1 < n; ++i) {
      const uint32_t a = j * n + i;
      surface.faces.push_back({a, a + 1, a + n});
      surface.faces.push_back({a + 1, a + n + 1, a + n});
    }
  }
  return surface;
}

TEST(Subdivide, ReproducesCubicsOfRegularLattices) {
  const auto cubic = [](double u, double v) { return u * u * u - 2 * u * v * v + v * v - u * v; };
  const Mesh mesh = to_mesh(lattice(13, cubic), Scalar::f64);
  for (const SubdivisionScheme scheme : both) {
    size_t inside = 0;
    for (const Position& p : subdivided(mesh, scheme, 2).points) {
      const double j = p[1] / std::sqrt(0.75), i = p[0] - j / 2;
      if (std::min(i, j) < 4.5 || std::max(i, j) > 7.5) continue;
      EXPECT_NEAR(p[2], cubic(p[0], p[1]), 1e-9);
      ++inside;
    }
    EXPECT_GT(inside, 50u);
  }
}

TEST(Subdivide, BordersDependOnThemselvesOnly) {
  const auto flat = [](double, double) { return 0.0; };
  const auto bump = [](double u, double v) { return u > 2 && v > 1.5 && v < 3 && u < 5 ? 1.0 : 0.0; };
  for (const SubdivisionScheme scheme : both) {
    const TriangleSurface a = subdivided(to_mesh(lattice(6, flat), Scalar::f64), scheme, 2);
    const TriangleSurface b = subdivided(to_mesh(lattice(6, bump), Scalar::f64), scheme, 2);
    size_t moved = 0;
    for (uint32_t h = 0; h < a.half_edges(); ++h) {
      const bool same = a.points[a.origin(h)] == b.points[b.origin(h)];
      EXPECT_TRUE(same || a.opposite[h] != TriangleSurface::border);
      moved += !same;
    }
    EXPECT_GT(moved, 0u);
  }
}

/// Corners of the small triangles of one block, in order.
std::vector<Position> corners_of_block(const TriangleSurface& surface, SubdivisionScheme scheme,
                                       uint32_t first, uint32_t end) {
  const bool butterfly = scheme == SubdivisionScheme::butterfly;
  RingWeights weights(butterfly ? butterfly_ring_weights : sqrt3_ring_weights);
  const unsigned around = butterfly ? 2 : 3;
  SurfaceBlock block = BlockCutter(surface).cut(first, end, around);
  for (const unsigned rings : {around, around, 0u})
    block = butterfly ? refined(block, weights, rings) : trisected(block, weights, rings);
  EXPECT_EQ(block.inner, (butterfly ? 64 : 729) * (end - first));
  std::vector<Position> corners;
  for (uint32_t h = 0; h < 3 * block.inner; ++h)
    corners.push_back(block.surface.points[block.surface.corners[h]]);
  return corners;
}

TEST(Subdivide, BlocksCutOutOfASurfaceAreSubdividedAsInTheWhole) {
  for (const Shape& shape : all_shapes()) {
    SCOPED_TRACE(shape.name);
    const TriangleSurface surface = *triangle_surface(mesh_of(shape.surface));
    for (const SubdivisionScheme scheme : both) {
      const std::vector<Position> whole = corners_of_block(surface, scheme, 0, surface.triangles());
      const size_t corners = whole.size() / surface.triangles();
      for (uint32_t first = 0; first < surface.triangles(); first += 2) {
        const uint32_t end = std::min(first + 2, surface.triangles());
        const std::vector<Position> part = corners_of_block(surface, scheme, first, end);
        for (size_t i = 0; i < part.size(); ++i) {
          for (size_t k = 0; k < 3; ++k) ASSERT_NEAR(part[i][k], whole[corners * first + i][k], 1e-13);
        }
      }
    }
  }
}

TEST(Subdivide, TwoTrianglesBackToBackAreASurfaceToo) {
  const Surface pillow{{{0, 0, 0}, {3, 0, 0}, {0, 3, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  Collected out;
  ASSERT_TRUE(subdivide(to_mesh(pillow), {SubdivisionScheme::butterfly, 3}, out));
  EXPECT_EQ(out.surface.triangles(), 128u);
  for (const Position& p : out.surface.points)
    EXPECT_LT(std::fabs(p[0]) + std::fabs(p[1]) + std::fabs(p[2]), 10);
}

TEST(Subdivide, RingWeightsAreTaylorPredictionsOfOrder2) {
  for (unsigned k = 3; k <= 16; ++k) {
    const std::string valence = std::to_string(k);
    expect_weights(butterfly_ring_weights(k), weights_of("modified-butterfly:" + valence));
    // The ring's angle is turned by half a triangle: the target lies between ring vertices 0 and 1.
    expect_weights(sqrt3_ring_weights(k), weights_of("sqrt3-ring:" + valence));
  }
}

TEST(Subdivide, ASphereStaysRound) {
  Surface icosahedron;
  const double t = (1 + std::sqrt(5.0)) / 2;
  for (const double s : {-1.0, 1.0}) {
    for (const double r : {-t, t})
      icosahedron.points.insert(icosahedron.points.end(), {{0, s, r}, {s, r, 0}, {r, 0, s}});
  }
  const auto distance = [&](uint32_t a, uint32_t b) {
    double sum = 0;
    for (size_t k = 0; k < 3; ++k) sum += std::pow(icosahedron.points[a][k] - icosahedron.points[b][k], 2);
    return std::sqrt(sum);
  };
  const auto outwards = [&](uint32_t a, uint32_t b, uint32_t c) {
    const auto& p = icosahedron.points;
    return p[a][0] * (p[b][1] * p[c][2] - p[b][2] * p[c][1]) -
           p[a][1] * (p[b][0] * p[c][2] - p[b][2] * p[c][0]) +
           p[a][2] * (p[b][0] * p[c][1] - p[b][1] * p[c][0]);
  };
  for (uint32_t a = 0; a < 12; ++a) {
    for (uint32_t b = a + 1; b < 12; ++b) {
      for (uint32_t c = b + 1; c < 12; ++c) {
        if (distance(a, b) > 2.1 || distance(b, c) > 2.1 || distance(a, c) > 2.1) continue;
        icosahedron.faces.push_back(outwards(a, b, c) > 0 ? std::vector{a, b, c} : std::vector{a, c, b});
      }
    }
  }
  ASSERT_EQ(icosahedron.faces.size(), 20u);
  const double radius = std::sqrt(1 + t * t);
  for (const SubdivisionScheme scheme : both) {
    for (const Position& p : subdivided(to_mesh(icosahedron, Scalar::f64), scheme, 4).points) {
      const double r = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
      EXPECT_NEAR(r / radius, 1, .05);
    }
  }
}

std::string complaint(const Mesh& mesh, SubdivisionOptions options = {}) {
  Collected out;
  const auto result = subdivide(mesh, options, out);
  return result ? "none" : result.error().message;
}

TEST(Subdivide, SaysWhyAMeshCannotBeSubdivided) {
  EXPECT_THAT(complaint(cube()), HasSubstr("block 0, cell 0 has 4 corners"));
  EXPECT_THAT(complaint(to_mesh(shapes::book(3))), HasSubstr("belongs to 3 triangles"));
  Surface turned = shapes::tetrahedron();
  std::swap(turned.faces[1][0], turned.faces[1][1]);
  EXPECT_THAT(complaint(to_mesh(turned)), HasSubstr("disagree on which side is up"));
  Surface degenerate = shapes::tetrahedron();
  degenerate.faces[2][0] = degenerate.faces[2][1];
  EXPECT_THAT(complaint(to_mesh(degenerate)), HasSubstr("the same point twice"));
  Surface infinite = shapes::tetrahedron();
  infinite.points[1][2] = INFINITY;
  EXPECT_THAT(complaint(to_mesh(infinite)), HasSubstr("point 1 is not finite"));
  EXPECT_THAT(complaint(to_mesh(shapes::tetrahedron()), {SubdivisionScheme::butterfly, 0}),
              HasSubstr("0 levels"));
  EXPECT_THAT(complaint(to_mesh(shapes::tetrahedron()), {SubdivisionScheme::sqrt3, 100}),
              HasSubstr("take fewer"));
  EXPECT_THAT(complaint(to_mesh(shapes::tetrahedron()), {SubdivisionScheme::butterfly, 16}),
              HasSubstr("take fewer"));
}

TEST(Subdivide, TakesOrRefusesWhateverTrianglesThereAre) {
  unsigned taken = 0, refused = 0;
  for (uint64_t seed = 0; seed < 600; ++seed) {
    Random random(seed);
    Surface surface = random_shape(random, 40);
    if (seed % 2 == 0) mutilate(surface, random, true);
    const Mesh mesh = mesh_of(surface);
    const SubdivisionOptions options{both[seed / 2 % 2], static_cast<unsigned>(1 + seed % 3)};
    Collected out;
    if (const auto result = subdivide(mesh, options, out); !result) {
      EXPECT_EQ(result.error().code, ErrorCode::malformed_input) << result.error().message;
      ++refused;
      continue;
    }
    ++taken;
    EXPECT_EQ(out.surface.points.size(), out.point_count);
    EXPECT_EQ(out.surface.triangles(), out.triangle_count);
    for (const uint32_t corner : out.surface.corners) ASSERT_LT(corner, out.point_count);
    for (const Position& p : out.surface.points) {
      ASSERT_TRUE(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2])) << seed;
    }
  }
  EXPECT_GT(taken, 150u);
  EXPECT_GT(refused, 100u);
}

TEST(Subdivide, AnErrorOfTheOutputEndsIt) {
  class Full final : public SubdivisionOutput {
   public:
    Result<> begin(uint64_t, uint64_t) override { return {}; }
    Result<> points(std::span<const double>) override {
      return failure(ErrorCode::write_failed, "disk full");
    }
    Result<> triangles(std::span<const uint32_t>) override {
      ADD_FAILURE();
      return {};
    }
  } full;
  const auto result = subdivide(to_mesh(shapes::tetrahedron()), {}, full);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().message, "disk full");
}

TEST(Subdivide, NothingStaysNothing) {
  EXPECT_EQ(subdivided(Mesh{}, SubdivisionScheme::butterfly, 2).points.size(), 0u);
  EXPECT_EQ(subdivided(Mesh{}, SubdivisionScheme::sqrt3, 2).points.size(), 0u);
}

}  // namespace
}  // namespace maille::testing
