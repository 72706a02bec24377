#include "surface/front/smooth_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/random_mesh.h"
#include "support/shapes.h"
#include "surface/patch_topology.h"

namespace maille::testing {
namespace {

/// A mesh as the decoder of its positions sees it.
struct Coded {
  Mesh mesh;
  EncodedTopology encoded;
  std::vector<Vector3> positions;  ///< by point in coded order

  explicit Coded(Mesh from) : mesh(std::move(from)) {
    auto topology = encode_topology(mesh);
    EXPECT_TRUE(topology) << topology.error().message;
    if (topology) encoded = std::move(*topology);
    // Those that predictors are given are finite.
    const auto number = [&](size_t i) {
      if (i >= mesh.point_count() * 3 || !is_float(mesh.points.type)) return 0.0;
      const double value = mesh.points.type == Scalar::f64 ? mesh.points.values<double>()[i]
                                                           : double{mesh.points.values<float>()[i]};
      return std::fabs(value) < 1e30 ? value : 0.0;
    };
    for (const uint32_t source : encoded.sources.points) {
      const size_t i = size_t{source} * 3;
      positions.push_back({{number(i), number(i + 1), number(i + 2)}});
    }
  }
  const PatchSurface& surface() const { return encoded.topology.surface; }
};

/// Distances from what is expected to what is, for all vertices of which something is known; the base is the
/// vertex before.
std::vector<double> misses(const Coded& coded) {
  const VertexRings rings(coded.surface());
  SmoothSurface smooth(coded.surface(), rings);
  std::vector<double> misses;
  std::vector<Vector3> known(coded.positions.size());
  uint32_t next = 0;
  for (uint32_t vertex = 0; vertex < coded.surface().vertices.size(); ++vertex) {
    const uint32_t point = coded.surface().point(vertex);
    if (point != next) continue;  // of another fan
    ++next;
    Vector3 found;
    if (point > 0 && smooth.predict(vertex, known, known[point - 1], found)) {
      const Vector3 apart = found - coded.positions[point];
      misses.push_back(std::sqrt(dot(apart, apart)));
    }
    known[point] = coded.positions[point];
  }
  return misses;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

Mesh wavy_grid(uint32_t n, double height) {
  Mesh mesh = grid(n, n);
  const auto values = mesh.points.values<float>();
  for (size_t i = 0; i < values.size(); i += 3) {
    const double x = static_cast<double>(values[i]), y = static_cast<double>(values[i + 1]);
    values[i + 2] = static_cast<float>(height * std::sin(0.3 * x) * std::cos(0.25 * y));
  }
  return mesh;
}

TEST(SmoothSurface, GoesOnFlatAndEven) {
  const Coded coded(wavy_grid(30, 0));
  const auto all = misses(coded);
  ASSERT_GT(all.size(), 800u);
  EXPECT_LT(median(all), 0.05);  // short edges pull a little
}

TEST(SmoothSurface, FollowsCurvature) {
  const auto all = misses(Coded(wavy_grid(40, 2)));
  ASSERT_GT(all.size(), 1500u);
  // A parallelogram misses by about the second difference: 2 * 0.3 * 0.25.
  EXPECT_LT(median(all), 0.04);
}

TEST(SmoothSurface, PredictsTheSameInAnyPlaceAndSize) {
  Mesh mesh = wavy_grid(20, 2);
  const auto here = misses(Coded(mesh));
  for (float& value : mesh.points.values<float>()) value = value * 64 + 8192;
  const auto there = misses(Coded(mesh));
  ASSERT_EQ(here.size(), there.size());
  for (size_t i = 0; i < here.size(); ++i) ASSERT_NEAR(here[i] * 64, there[i], 0.05) << i;
}

TEST(SmoothSurface, RowsOfTheBorderGoAlongIt) {
  const Coded coded(grid(8, 8));
  const VertexRings rings(coded.surface());
  unsigned border = 0;
  for (uint32_t vertex = 0; vertex < coded.surface().vertices.size(); ++vertex) {
    const auto row = rings.row(vertex);
    if (!rings.has_part_only(vertex)) continue;
    EXPECT_EQ(row.size(), 2u);
    for (const uint32_t neighbour : row) {
      const auto back = rings.row(neighbour);
      EXPECT_NE(std::find(back.begin(), back.end(), vertex), back.end());
    }
    ++border;
  }
  EXPECT_GE(border, 24u);
}

TEST(SmoothSurface, VerticesOfManyNeighboursHaveNoRow) {
  Mesh mesh;
  const uint32_t spokes = 1000;
  mesh.points = make_array("points", Domain::point, Scalar::f32, 3);
  mesh.points.resize(spokes + 1);
  CellBlock& block = mesh.blocks.emplace_back();
  block.type = CellType::triangle;
  for (uint32_t i = 0; i < spokes; ++i) {
    for (const uint32_t node : {spokes, i, (i + 1) % spokes}) block.connectivity.push_back(node);
    mesh.points.values<float>()[3 * i] = static_cast<float>(i);
  }
  const Coded coded(mesh);
  const VertexRings rings(coded.surface());
  size_t listed = 0, hubs = 0;
  for (uint32_t vertex = 0; vertex <= spokes; ++vertex) {
    listed += rings.all(vertex).size();
    hubs += rings.row(vertex).empty() ? 1 : 0;
  }
  EXPECT_EQ(hubs, 1u);
  EXPECT_LE(listed, 3 * spokes + VertexRings::most);
  for (const double miss : misses(coded)) ASSERT_TRUE(std::isfinite(miss));
}

TEST(SmoothSurface, IsFiniteOnAnyMesh) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    for (const double miss : misses(Coded(random_surface(seed, {.faces = 60}))))
      ASSERT_TRUE(std::isfinite(miss)) << seed;
  }
}

}  // namespace
}  // namespace maille::testing
