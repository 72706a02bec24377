#include "random/build/spatial_graph.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/sort_few.h"

namespace maille {
namespace {

/// Edges by their smaller vertex; each as larger vertex << 32 | face.
struct EdgeTable {
  std::vector<uint32_t> first;
  std::vector<uint64_t> edges;
};

template <class F>
void for_each_edge(const FaceLists& faces, F f) {
  for (uint32_t i = 0; i < faces.size(); ++i) {
    const auto corners = faces.face(i);
    for (size_t k = 0; k < corners.size(); ++k) {
      const uint32_t a = corners[k], b = corners[k + 1 == corners.size() ? 0 : k + 1];
      if (a != b) f(std::min(a, b), std::max(a, b), i);
    }
  }
}

EdgeTable edges_of(const FaceLists& faces, uint32_t vertices) {
  EdgeTable table;
  table.first.assign(size_t{vertices} + 1, 0);
  for_each_edge(faces, [&](uint32_t a, uint32_t, uint32_t) { ++table.first[a + 1]; });
  for (uint32_t v = 0; v < vertices; ++v) table.first[v + 1] += table.first[v];
  table.edges.resize(table.first[vertices]);
  std::vector<uint32_t> next(table.first.begin(), table.first.end() - 1);
  for_each_edge(faces, [&](uint32_t a, uint32_t b, uint32_t face) {
    table.edges[next[a]++] = uint64_t{b} << 32 | face;
  });
  for (uint32_t v = 0; v < vertices; ++v) {
    // A vertex has few edges; edges with the same ends come together, so that for_each_link() finds the faces
    // at them.
    sort_few(std::span(table.edges).subspan(table.first[v], table.first[v + 1] - table.first[v]));
  }
  return table;
}

/// Calls f(face, face) for faces that follow each other at an edge. Where more than two faces meet, they form
/// a chain and not a clique: an edge with thousands of faces, which a hostile mesh may have, would make
/// millions of links.
template <class F>
void for_each_link(const EdgeTable& table, F f) {
  for (size_t v = 0; v + 1 < table.first.size(); ++v) {
    for (uint32_t i = table.first[v] + 1; i < table.first[v + 1]; ++i) {
      const uint64_t before = table.edges[i - 1], edge = table.edges[i];
      if (before >> 32 == edge >> 32 && before != edge) {
        f(static_cast<uint32_t>(before), static_cast<uint32_t>(edge));
      }
    }
  }
}

/// Lists of neighbours in one array, by counting: no allocation for each node, and an order that depends on
/// the faces alone.
void link(const EdgeTable& table, SpatialGraph& graph) {
  graph.first.assign(size_t{graph.size()} + 1, 0);
  for_each_link(table, [&](uint32_t a, uint32_t b) {
    ++graph.first[a + 1];
    ++graph.first[b + 1];
  });
  for (uint32_t i = 0; i < graph.size(); ++i) graph.first[i + 1] += graph.first[i];
  graph.neighbour.resize(graph.first.back());
  std::vector<uint32_t> next(graph.first.begin(), graph.first.end() - 1);
  for_each_link(table, [&](uint32_t a, uint32_t b) {
    graph.neighbour[next[a]++] = b;
    graph.neighbour[next[b]++] = a;
  });
}

/// Numbers that are none lie at 0: a total order needs some place.
std::array<float, 3> mean_of(std::span<const uint32_t> corners, std::span<const float> positions) {
  const auto count = static_cast<double>(std::max<size_t>(corners.size(), 1));
  std::array<float, 3> mean;
  for (unsigned k = 0; k < 3; ++k) {
    const auto number = [&](uint32_t corner) {
      return static_cast<double>(positions[size_t{3} * corner + k]);
    };
    double sum = 0;
    for (const uint32_t corner : corners) sum += number(corner);
    if (!std::isfinite(sum)) {
      sum = 0;
      for (const uint32_t corner : corners) sum += std::isfinite(number(corner)) ? number(corner) : 0;
    }
    mean[k] = static_cast<float>(sum / count);
  }
  return mean;
}

}  // namespace

SpatialGraph dual_graph(const FaceLists& faces, std::span<const float> positions, uint32_t vertices) {
  SpatialGraph graph;
  graph.place.reserve(faces.size());
  for (uint32_t i = 0; i < faces.size(); ++i) graph.place.push_back(mean_of(faces.face(i), positions));
  if (!faces.first.empty()) {
    graph.node_weight.reserve(faces.size());
    for (uint32_t i = 0; i < faces.size(); ++i) {
      // A polygon counts as the triangles that it is shown as.
      graph.node_weight.push_back(static_cast<uint32_t>(std::max<size_t>(faces.face(i).size(), 3)) - 2);
    }
  }
  link(edges_of(faces, vertices), graph);
  return graph;
}

}  // namespace maille
