#include "random/build/simplifier.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "random/build/deviation.h"
#include "random/read/triangle_tree.h"
#include "support/cases.h"
#include "support/faces_in_space.h"
#include "support/random.h"
#include "support/random_mesh.h"

namespace maille::testing {
namespace {

struct Input {
  FacesInSpace faces;
  std::vector<uint8_t> locked;

  explicit Input(FacesInSpace from) : faces(std::move(from)), locked(faces.vertices()) {
    if (faces.first.empty()) return;
    std::vector<uint32_t> triangles;
    for (uint32_t i = 0; i < faces.lists().size(); ++i) {
      const auto c = faces.lists().face(i);
      for (size_t k = 2; k < c.size(); ++k) triangles.insert(triangles.end(), {c[0], c[k - 1], c[k]});
    }
    faces.corners = triangles;
    faces.first.clear();
  }
  SimplifierInput view(uint32_t target, bool to_the_end = false) const {
    return {faces.corners, faces.positions, locked, target, to_the_end};
  }
};

/// Edges with an odd number of triangles: the border.
std::set<std::pair<uint32_t, uint32_t>> odd_edges(const std::vector<uint32_t>& triangles) {
  std::set<std::pair<uint32_t, uint32_t>> odd;
  for (size_t t = 0; t < triangles.size(); t += 3) {
    for (unsigned k = 0; k < 3; ++k) {
      const auto edge = std::minmax(triangles[t + k], triangles[t + (k + 1) % 3]);
      if (edge.first == edge.second) continue;
      if (!odd.insert(edge).second) odd.erase(edge);
    }
  }
  return odd;
}

TEST(Simplifier, LeavesAFourthOfASmoothSurfaceCloseToIt) {
  const Input input(hills(64, 2));
  const Simplified simplified = simplify(input.view(2048));
  EXPECT_LE(simplified.triangles.size() / 3, 2048u);
  EXPECT_GE(simplified.triangles.size() / 3, 1900u);
  EXPECT_LT(simplified.view_error, 0.1);
  EXPECT_LT(deviation(input.view(2048), simplified), 0.2);
}

TEST(Simplifier, LosesNothingOfAPlane) {
  const Input input(hills(32, 0));
  const Simplified simplified = simplify(input.view(100));
  EXPECT_LE(simplified.triangles.size() / 3, 100u);
  EXPECT_LT(deviation(input.view(100), simplified), 1e-9);
}

TEST(Simplifier, LeavesLockedVerticesAndTheirBorder) {
  Input input(hills(24, 1));
  for (uint32_t v = 0; v < input.faces.vertices(); ++v) {
    input.locked[v] = v % 25 == 0 || v % 25 == 24 || v < 25 || v >= 24 * 25;
  }
  const Simplified simplified = simplify(input.view(200));
  EXPECT_LE(simplified.triangles.size() / 3, 200u);
  EXPECT_EQ(odd_edges(simplified.triangles), odd_edges(input.faces.corners));
}

TEST(Simplifier, LetsSmallComponentsVanishBeforeLargeOnesSuffer) {
  Surface scene = shapes::sphere(48, 24);
  for (unsigned i = 0; i < 50; ++i) {
    Surface speck = shapes::tetrahedron();
    for (auto& p : speck.points) {
      for (double& x : p) x *= 1e-4;
    }
    append(scene, speck, {20.0 + i, 0, 0});
  }
  const Input input(faces_in_space(scene));
  const Simplified simplified = simplify(input.view(400));
  EXPECT_LE(simplified.triangles.size() / 3, 400u);
  for (const uint32_t v : simplified.triangles)
    EXPECT_LT(std::abs(input.faces.positions[size_t{3} * v]), 11.0f);
  EXPECT_GT(simplified.lost_component, 0);
}

TEST(Simplifier, TakesAnyTrianglesAndKeepsASubsetOfTheirVertices) {
  for (uint64_t seed = 0; seed < cases(1500); ++seed) {
    RandomMeshOptions options;
    options.any_position_type = false;
    options.degenerate_faces = seed % 2 == 0;
    Input input(faces_in_space(random_surface(seed, options)));
    Random random(seed);
    for (uint8_t& locked : input.locked) locked = random.chance(10);
    const auto count = static_cast<uint32_t>(input.faces.corners.size() / 3);
    const SimplifierInput view = input.view(count / 4, seed % 3 == 0);
    const Simplified simplified = simplify(view);
    EXPECT_LE(simplified.triangles.size(), input.faces.corners.size());
    const std::set<uint32_t> before(input.faces.corners.begin(), input.faces.corners.end());
    for (const uint32_t v : simplified.triangles) ASSERT_TRUE(before.count(v)) << seed;
    for (uint32_t v = 0; v < input.locked.size(); ++v) {
      if (input.locked[v]) {
        ASSERT_EQ(simplified.root[v], v) << seed;
      }
    }
    EXPECT_FALSE(std::isnan(simplified.view_error)) << seed;
    EXPECT_FALSE(std::isnan(deviation(view, simplified))) << seed;
  }
}

double distance_by_trying(const TriangleTree& tree_of_one, const Vector3& p) {
  return tree_of_one.squared_distance(p, std::numeric_limits<double>::infinity());
}

TEST(TriangleTree, FindsTheNearestOfAll) {
  Random random(9);
  const Input input(faces_in_space(shapes::torus(12, 9)));
  const TriangleTree tree(input.faces.corners, input.faces.positions);
  for (uint64_t i = 0; i < cases(300); ++i) {
    const Vector3 p{{3 * random.unit() - 1, 3 * random.unit() - 1, 3 * random.unit() - 1}};
    double nearest = std::numeric_limits<double>::infinity();
    for (size_t t = 0; t < input.faces.corners.size(); t += 3) {
      const TriangleTree one(std::span(input.faces.corners).subspan(t, 3), input.faces.positions);
      nearest = std::min(nearest, distance_by_trying(one, p));
    }
    EXPECT_EQ(tree.squared_distance(p, std::numeric_limits<double>::infinity()), nearest);
    EXPECT_EQ(tree.squared_distance(p, nearest / 2), nearest / 2);
    // Any distance from a triangle will do then; else none but the least.
    const double near_enough = tree.squared_distance(p, 1e9, 2 * nearest);
    EXPECT_GE(near_enough, nearest);
    EXPECT_LE(near_enough, 2 * nearest);
    EXPECT_EQ(tree.squared_distance(p, 1e9, nearest / 2), nearest);
  }
}

TEST(TriangleTree, OpensNoMoreBoxesThanAllowed) {
  const Input input(faces_in_space(shapes::torus(40, 30)));
  const TriangleTree tree(input.faces.corners, input.faces.positions);
  const Vector3 p{{0.1, 0.2, 0.3}};
  const double nearest = tree.squared_distance(p, 1e9);
  EXPECT_EQ(tree.squared_distance(p, 1e9, 0, 0), 1e9);
  double before = 1e9;
  for (unsigned most = 1; most < 2000; most *= 2) {
    const double found = tree.squared_distance(p, 1e9, 0, most);
    EXPECT_GE(found, nearest);
    EXPECT_LE(found, before);
    before = found;
  }
  EXPECT_EQ(before, nearest);
}

TEST(TriangleTree, KnowsFacesEdgesAndCorners) {
  const std::vector<float> positions = {0, 0, 0, 4, 0, 0, 0, 4, 0};
  const std::vector<uint32_t> triangle = {0, 1, 2};
  const TriangleTree tree(triangle, positions);
  EXPECT_DOUBLE_EQ(tree.squared_distance({{1, 1, 3}}, 1e9), 9);
  EXPECT_DOUBLE_EQ(tree.squared_distance({{2, -2, 0}}, 1e9), 4);
  EXPECT_DOUBLE_EQ(tree.squared_distance({{-3, -4, 0}}, 1e9), 25);
  EXPECT_DOUBLE_EQ(tree.squared_distance({{3, 3, 0}}, 1e9), 2);
}

}  // namespace
}  // namespace maille::testing
