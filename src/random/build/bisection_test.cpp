#include "random/build/bisection.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "random/build/clusters.h"
#include "random/build/minimum_cut.h"
#include "support/cases.h"
#include "support/faces_in_space.h"
#include "support/random.h"
#include "support/random_mesh.h"

namespace maille::testing {
namespace {

uint64_t cut_of(const SpatialGraph& graph, const std::vector<uint32_t>& part_of) {
  uint64_t cut = 0;
  for (uint32_t i = 0; i < graph.size(); ++i) {
    for (uint32_t a = graph.first[i]; a < graph.first[i + 1]; ++a)
      cut += part_of[graph.neighbour[a]] > part_of[i];
  }
  return cut;
}

std::vector<uint64_t> weights_of(const SpatialGraph& graph, const std::vector<uint32_t>& part_of) {
  std::vector<uint64_t> weights;
  for (uint32_t i = 0; i < graph.size(); ++i) {
    if (part_of[i] >= weights.size()) weights.resize(part_of[i] + 1);
    weights[part_of[i]] += graph.weight(i);
  }
  return weights;
}

/// Nodes in two clumps of n with few links between them.
SpatialGraph two_clumps(uint32_t n, uint32_t links, Random& random) {
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  for (uint32_t clump = 0; clump < 2; ++clump) {
    for (uint32_t i = 1; i < n; ++i) {
      for (unsigned k = 0; k < 4; ++k) edges.emplace_back(clump * n + i, clump * n + random.below(i));
    }
  }
  for (uint32_t i = 0; i < links; ++i) edges.emplace_back(random.below(n), n + random.below(n));
  SpatialGraph graph;
  std::vector<std::vector<uint32_t>> lists(size_t{2} * n);
  for (const auto& [a, b] : edges) {
    lists[a].push_back(b);
    lists[b].push_back(a);
  }
  graph.first.push_back(0);
  for (const auto& list : lists) {
    graph.neighbour.insert(graph.neighbour.end(), list.begin(), list.end());
    graph.first.push_back(static_cast<uint32_t>(graph.neighbour.size()));
    graph.place.push_back({static_cast<float>(random.unit()), 0, 0});
  }
  return graph;
}

TEST(DualGraph, LinksFacesAtOneEdgeAsAChain) {
  const SpatialGraph graph = faces_in_space(shapes::book(5)).graph();
  EXPECT_EQ(graph.neighbour, (std::vector<uint32_t>{1, 0, 2, 1, 3, 2, 4, 3}));
}

TEST(DualGraph, WeighsPolygonsAsTriangles) {
  const SpatialGraph graph = faces_in_space(shapes::cube()).graph();
  EXPECT_EQ(graph.weight(0), 2u);
  EXPECT_EQ(graph.neighbour.size(), 24u);
}

TEST(BandCut, FindsTheFewLinksBetweenTwoClumps) {
  Random random(5);
  for (uint64_t i = 0; i < cases(50); ++i) {
    const SpatialGraph graph = two_clumps(100, 3, random);
    std::vector<uint8_t> right(200);
    for (uint32_t v = 0; v < 200; ++v) right[v] = v >= 85;  // fifteen on the wrong side
    TwoSides sides = weigh_sides(graph, right);
    BandCut band(graph);
    EXPECT_TRUE(band.improve(sides, {100, 60, 140}, 16));
    EXPECT_LE(sides.cut, 3u);
    EXPECT_EQ(sides.cut, weigh_sides(graph, sides.right).cut);
    EXPECT_EQ(sides.left_weight, weigh_sides(graph, sides.right).left_weight);
  }
}

TEST(BandCut, NeverLeavesTheBalance) {
  Random random(6);
  for (uint64_t i = 0; i < cases(200); ++i) {
    const SpatialGraph graph = two_clumps(30 + random.below(50), random.below(40), random);
    std::vector<uint8_t> right(graph.size());
    for (uint32_t v = 0; v < graph.size(); ++v) right[v] = v >= graph.size() / 2 ? 1 : 0;
    shuffle(right, random);
    TwoSides sides = weigh_sides(graph, right);
    const uint64_t before = sides.cut, half = graph.size() / 2, slack = random.below(half / 2);
    BandCut band(graph);
    while (band.improve(sides, {half, half - slack, half + slack}, 1 + random.below(20))) {
    }
    EXPECT_LE(sides.cut, before);
    EXPECT_GE(sides.left_weight, half - slack);
    EXPECT_LE(sides.left_weight, half + slack);
    EXPECT_EQ(sides.cut, weigh_sides(graph, sides.right).cut);
  }
}

TEST(Clusters, HangTogetherAndHaveEveryNodeOnce) {
  const SpatialGraph graph = hills(64, 3).graph();
  const ClusteredNodes clustered = cluster_nodes(graph, 32);
  std::vector<uint32_t> nodes = clustered.order;
  std::sort(nodes.begin(), nodes.end());
  for (uint32_t i = 0; i < graph.size(); ++i) ASSERT_EQ(nodes[i], i);
  const SpatialGraph ordered = reordered(graph, clustered.order);
  std::vector<uint32_t> size(clustered.cluster.back() + 1);
  for (uint32_t i = 0; i < ordered.size(); ++i) {
    const uint32_t own = clustered.cluster[i];
    bool beside = size[own]++ == 0;
    for (uint32_t a = ordered.first[i]; a < ordered.first[i + 1]; ++a)
      beside = beside || (ordered.neighbour[a] < i && clustered.cluster[ordered.neighbour[a]] == own);
    EXPECT_TRUE(beside) << "node " << i << " does not touch what its cluster has";
  }
  EXPECT_LE(*std::max_element(size.begin(), size.end()), 32u);
}

TEST(Clusters, KeepWeightsAndCutsWhenTheyBecomeNodes) {
  const SpatialGraph graph = hills(32, 3).graph();
  const ClusteredNodes clustered = cluster_nodes(graph, 16);
  const SpatialGraph ordered = reordered(graph, clustered.order);
  const SpatialGraph coarse = contracted(ordered, clustered.cluster);
  uint64_t weight = 0;
  for (uint32_t i = 0; i < coarse.size(); ++i) weight += coarse.weight(i);
  EXPECT_EQ(weight, graph.size());
  std::vector<uint8_t> right(coarse.size()), right_nodes(graph.size());
  for (uint32_t i = 0; i < coarse.size(); ++i) right[i] = i % 3 == 0;
  for (uint32_t i = 0; i < graph.size(); ++i) right_nodes[i] = right[clustered.cluster[i]];
  EXPECT_EQ(weigh_sides(coarse, right).cut, weigh_sides(ordered, right_nodes).cut);
  EXPECT_EQ(weigh_sides(coarse, right).left_weight, weigh_sides(ordered, right_nodes).left_weight);
}

TEST(Bisection, CutsAPlaneAboutAsShortAsSquaresWould) {
  const FacesInSpace plane = hills(128, 0);
  const SpatialGraph graph = plane.graph();
  const auto part_of = cut_into_parts(graph, {.target = 2048});
  const auto weights = weights_of(graph, part_of);
  ASSERT_EQ(weights.size(), 16u);
  for (const uint64_t weight : weights) {
    EXPECT_GT(weight, 2048u / 2);
    EXPECT_LT(weight, 2048u * 3 / 2);
  }
  // Sixteen squares of 32 x 32: six lines of 128 edges.
  EXPECT_LE(cut_of(graph, part_of), 6u * 128u * 11 / 10);
}

TEST(Bisection, KeepsBallsWhole) {
  Surface balls;
  for (unsigned i = 0; i < 64; ++i) {
    append(balls, shapes::sphere(10, 8), {3.0 * (i % 4), 3.0 * (i / 4 % 4), 3.0 * (i / 16)});
  }
  const SpatialGraph graph = faces_in_space(balls).graph();
  const auto part_of = cut_into_parts(graph, {.target = 512});
  EXPECT_GE(weights_of(graph, part_of).size(), 16u);
  EXPECT_EQ(cut_of(graph, part_of), 0u);
}

TEST(Bisection, TakesAnySurface) {
  for (uint64_t seed = 0; seed < cases(1000); ++seed) {
    RandomMeshOptions options;
    options.any_position_type = false;
    const SpatialGraph graph = faces_in_space(random_surface(seed, options)).graph();
    const auto part_of = cut_into_parts(graph, {.target = 1 + seed % 9});
    ASSERT_EQ(part_of.size(), graph.size());
    const auto weights = weights_of(graph, part_of);
    EXPECT_EQ(std::count(weights.begin(), weights.end(), 0u), 0) << "an empty part, seed " << seed;
  }
}

}  // namespace
}  // namespace maille::testing
