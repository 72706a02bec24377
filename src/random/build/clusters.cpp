#include "random/build/clusters.h"

#include <array>

namespace maille {

/// Clusters grow one after the other, each from a node beside those that exist, so no gaps of a few nodes are
/// left over.
ClusteredNodes cluster_nodes(const SpatialGraph& graph, uint32_t size) {
  ClusteredNodes result;
  std::vector<uint32_t>& order = result.order;
  order.reserve(graph.size());
  result.cluster.reserve(graph.size());
  std::vector<uint8_t> taken(graph.size());
  uint32_t clusters = 0, next_seed = 0;
  size_t next_border = 0;
  // Beside the clusters there are, or where a component begins.
  const auto find_seed = [&] {
    for (; next_border < order.size(); ++next_border) {
      const uint32_t node = order[next_border];
      for (uint32_t a = graph.first[node]; a < graph.first[node + 1]; ++a) {
        if (!taken[graph.neighbour[a]]) return graph.neighbour[a];
      }
    }
    while (taken[next_seed]) ++next_seed;
    return next_seed;
  };
  while (order.size() < graph.size()) {
    const size_t begin = order.size();
    const auto take = [&](uint32_t node) {
      if (taken[node] || order.size() - begin >= size) return;
      taken[node] = 1;
      order.push_back(node);
      result.cluster.push_back(clusters);
    };
    take(find_seed());
    for (size_t next = begin; next < order.size() && order.size() - begin < size; ++next) {
      const uint32_t node = order[next];
      for (uint32_t a = graph.first[node]; a < graph.first[node + 1]; ++a) take(graph.neighbour[a]);
    }
    ++clusters;
  }
  return result;
}

SpatialGraph reordered(const SpatialGraph& graph, std::span<const uint32_t> order) {
  std::vector<uint32_t> number(graph.size());
  for (uint32_t i = 0; i < order.size(); ++i) number[order[i]] = i;
  SpatialGraph result;
  result.place.reserve(graph.size());
  result.first.reserve(graph.first.size());
  result.neighbour.reserve(graph.neighbour.size());
  result.node_weight.reserve(graph.node_weight.size());
  result.edge_weight.reserve(graph.edge_weight.size());
  result.first.push_back(0);
  for (const uint32_t node : order) {
    result.place.push_back(graph.place[node]);
    if (!graph.node_weight.empty()) result.node_weight.push_back(graph.node_weight[node]);
    for (uint32_t a = graph.first[node]; a < graph.first[node + 1]; ++a) {
      result.neighbour.push_back(number[graph.neighbour[a]]);
      if (!graph.edge_weight.empty()) result.edge_weight.push_back(graph.edge_weight[a]);
    }
    result.first.push_back(static_cast<uint32_t>(result.neighbour.size()));
  }
  return result;
}

/// A node for each cluster, at the weighted mean of its places, with edges that weigh as much as all between
/// the two. So a cut of clusters costs what the same cut of nodes does.
SpatialGraph contracted(const SpatialGraph& graph, std::span<const uint32_t> cluster) {
  SpatialGraph result;
  const uint32_t clusters = cluster.empty() ? 0 : cluster.back() + 1;
  constexpr uint32_t nowhere = 0xffffffff;
  std::vector<uint32_t> edge_to(clusters, nowhere);  // by cluster: the edge to it from the one at hand
  result.first.reserve(size_t{clusters} + 1);
  result.first.push_back(0);
  for (uint32_t begin = 0, end = 0; begin < cluster.size(); begin = end) {
    const uint32_t own = cluster[begin], first = result.first.back();
    std::array<double, 3> sum{};
    uint32_t weight = 0;
    for (; end < cluster.size() && cluster[end] == own; ++end) {
      const uint32_t node_weight = graph.weight(end);
      weight += node_weight;
      for (unsigned k = 0; k < 3; ++k) sum[k] += node_weight * static_cast<double>(graph.place[end][k]);
      for (uint32_t a = graph.first[end]; a < graph.first[end + 1]; ++a) {
        const uint32_t to = cluster[graph.neighbour[a]];
        if (to == own) continue;
        uint32_t& edge = edge_to[to];
        // An entry below `first` belongs to an earlier cluster, so the table is never cleared.
        if (edge == nowhere || edge < first) {
          edge = static_cast<uint32_t>(result.neighbour.size());
          result.neighbour.push_back(to);
          result.edge_weight.push_back(0);
        }
        result.edge_weight[edge] += graph.weight_of_edge(a);
      }
    }
    std::array<float, 3> place;
    for (unsigned k = 0; k < 3; ++k) place[k] = static_cast<float>(sum[k] / weight);
    result.place.push_back(place);
    result.node_weight.push_back(weight);
    result.first.push_back(static_cast<uint32_t>(result.neighbour.size()));
  }
  return result;
}

}  // namespace maille
