#include "random/build/bisection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "random/build/clusters.h"
#include "random/build/minimum_cut.h"
#include "random/build/principal_axes.h"

namespace maille {
namespace {

/// Some nodes of the graph, in rising order, with the edges between them.
struct Subset {
  SpatialGraph graph;
  std::vector<uint32_t> nodes;    ///< numbers in the whole graph
  std::vector<uint32_t> cluster;  ///< by node: rising from 0; empty: it is small, or has none
  uint64_t weight = 0;
  uint32_t parts = 1;
};

/// Early cuts get 0.6 of the slack, because what they are off is inherited by all parts below them.
Balance balance_of(const Subset& subset, double slack) {
  const uint32_t left = subset.parts / 2;
  const double wished = static_cast<double>(subset.weight) * left / subset.parts;
  const double share = subset.parts <= 3 ? slack : 0.6 * slack;
  return {static_cast<uint64_t>(wished), static_cast<uint64_t>(std::ceil(wished * (1 - share))),
          static_cast<uint64_t>(wished * (1 + share))};
}

/// The first nodes of an order, up to the weight that is wished for, are the left side.
std::vector<uint8_t> split_order(const SpatialGraph& graph, const std::vector<uint32_t>& order,
                                 uint64_t wished) {
  std::vector<uint8_t> right(graph.size(), 1);
  uint64_t weight = 0;
  for (const uint32_t node : order) {
    if (weight >= wished) break;
    weight += graph.weight(node);
    right[node] = 0;
  }
  return right;
}

std::vector<float> projections(const SpatialGraph& graph, const std::array<double, 3>& axis) {
  std::vector<float> along(graph.size());
  for (uint32_t i = 0; i < graph.size(); ++i) {
    double sum = 0;
    for (unsigned k = 0; k < 3; ++k) sum += axis[k] * static_cast<double>(graph.place[i][k]);
    along[i] = static_cast<float>(sum);
  }
  return along;
}

/// With equal weights the place of the cut is known, and finding the n-th node is enough; otherwise all are
/// sorted.
std::vector<uint8_t> split_along(const SpatialGraph& graph, const std::vector<float>& along,
                                 uint64_t wished) {
  std::vector<uint32_t> order(graph.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto before = [&](uint32_t a, uint32_t b) {
    return along[a] != along[b] ? along[a] < along[b] : a < b;
  };
  if (graph.node_weight.empty()) {
    const auto middle = order.begin() + static_cast<ptrdiff_t>(std::min<uint64_t>(wished, order.size()));
    if (middle != order.end()) std::nth_element(order.begin(), middle, order.end(), before);
  } else {
    std::sort(order.begin(), order.end(), before);
  }
  return split_order(graph, order, wished);
}

std::vector<uint32_t> farthest_first(const std::vector<float>& along) {
  std::vector<uint32_t> order(along.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return along[a] != along[b] ? along[a] > along[b] : a < b; });
  return order;
}

/// Breadth first from the node that lies farthest along the axis; where a component ends, on from the
/// farthest that is left: a part of components that lie anywhere would have a large box.
std::vector<uint8_t> split_by_growth(const SpatialGraph& graph, const std::vector<float>& along,
                                     uint64_t wished) {
  std::vector<uint32_t> order, starts;
  std::vector<uint8_t> seen(graph.size());
  const auto take = [&](uint32_t node) {
    if (!seen[node]) order.push_back(node);
    seen[node] = 1;
  };
  take(static_cast<uint32_t>(std::max_element(along.begin(), along.end()) - along.begin()));
  uint64_t weight = 0;
  size_t start = 0;
  for (size_t next = 0; next < order.size() && weight < wished; ++next) {
    const uint32_t node = order[next];
    weight += graph.weight(node);
    for (uint32_t a = graph.first[node]; a < graph.first[node + 1]; ++a) take(graph.neighbour[a]);
    if (next + 1 < order.size() || order.size() == graph.size()) continue;
    if (starts.empty()) starts = farthest_first(along);
    while (seen[starts[start]]) ++start;
    take(starts[start]);
  }
  return split_order(graph, order, wished);
}

/// Nodes in a cluster, and nodes that it takes to look at clusters first: the larger the clusters, the less
/// time it takes; cuts become longer from 64 on.
constexpr uint32_t cluster_size = 32;
constexpr size_t least_clustered = 2048;

/// How wide bands are, as times the length of the cut.
struct BandFactors {
  uint32_t of_starts, of_best;
};
// Chosen without a record of a sweep: wider bands make shorter cuts, and flows in them take longer. Cutting
// clusters first took the dragon from 4.1-5.8 to 3.0-4.1 s of building (02c96d1).
constexpr BandFactors of_nodes{8, 16}, of_clusters{4, 8};

/// One cut of each start in a narrow band, and two more of the better one in a wide band.
TwoSides cut_in_two(const SpatialGraph& graph, const Balance& balance, unsigned most_axes,
                    const BandFactors& factors) {
  const auto axes = principal_axes(graph);
  const std::vector<float> along = projections(graph, axes[0]);
  BandCut band(graph);
  std::optional<TwoSides> best;
  const auto offer = [&](std::vector<uint8_t> right) {
    TwoSides sides = weigh_sides(graph, std::move(right));
    band.improve(sides, balance, factors.of_starts);
    if (!best || sides.cut < best->cut) best = std::move(sides);
  };
  offer(split_along(graph, along, balance.wished));
  for (unsigned k = 1; k < most_axes; ++k) {
    offer(split_along(graph, projections(graph, axes[k]), balance.wished));
  }
  offer(split_by_growth(graph, along, balance.wished));
  // The band moves with the cut, so a second round may find more.
  for (unsigned round = 0; round < 2; ++round) {
    if (!band.improve(*best, balance, factors.of_best)) break;
  }
  return std::move(*best);
}

/// Along clusters, then refined in a narrow band.
TwoSides cut_clusters(const Subset& subset, const Balance& balance, unsigned axes) {
  const TwoSides coarse = cut_in_two(contracted(subset.graph, subset.cluster), balance, axes, of_clusters);
  std::vector<uint8_t> right(subset.graph.size());
  for (size_t i = 0; i < right.size(); ++i) right[i] = coarse.right[subset.cluster[i]];
  TwoSides sides = weigh_sides(subset.graph, std::move(right));
  BandCut(subset.graph).improve(sides, balance, of_nodes.of_starts);
  return sides;
}

/// Halves the list where no cut leaves nodes on both sides.
void ensure_two_sides(TwoSides& sides) {
  const auto rights = std::count(sides.right.begin(), sides.right.end(), uint8_t{1});
  if (rights != 0 && static_cast<size_t>(rights) != sides.right.size()) return;
  for (size_t i = 0; i < sides.right.size(); ++i) sides.right[i] = i >= sides.right.size() / 2;
}

/// Room for so many nodes and edges.
void make_room(Subset& side, const Subset& whole, size_t nodes, size_t edges) {
  SpatialGraph& to = side.graph;
  side.nodes.resize(nodes);
  to.place.resize(nodes);
  to.first.resize(nodes + 1);
  to.neighbour.resize(edges);
  if (!whole.graph.node_weight.empty()) to.node_weight.resize(nodes);
  if (!whole.graph.edge_weight.empty()) to.edge_weight.resize(edges);
  if (!whole.cluster.empty() && nodes >= least_clustered) side.cluster.resize(nodes);
}

/// Nodes of both sides. Returns the number of each in its side.
std::vector<uint32_t> take_nodes(const Subset& whole, const std::vector<uint8_t>& right,
                                 std::array<Subset, 2>& sides) {
  const SpatialGraph& from = whole.graph;
  std::vector<uint32_t> number(from.size());
  std::array<uint32_t, 2> count{}, cluster{}, clusters{};
  for (uint32_t i = 0; i < from.size(); ++i) {
    const uint8_t s = right[i];
    Subset& side = sides[s];
    const uint32_t n = number[i] = count[s]++;
    side.graph.place[n] = from.place[i];
    if (!from.node_weight.empty()) side.graph.node_weight[n] = from.node_weight[i];
    side.weight += from.weight(i);
    side.nodes[n] = whole.nodes[i];
    if (side.cluster.empty()) continue;
    clusters[s] += n == 0 || whole.cluster[i] != cluster[s];
    cluster[s] = whole.cluster[i];
    side.cluster[n] = clusters[s] - 1;
  }
  return number;
}

/// Both sides, with the edges within them.
std::array<Subset, 2> take_sides(const Subset& whole, const std::vector<uint8_t>& right) {
  const SpatialGraph& from = whole.graph;
  std::array<Subset, 2> sides;
  std::array<size_t, 2> nodes{}, edges{};
  for (uint32_t i = 0; i < from.size(); ++i) {
    ++nodes[right[i]];
    edges[right[i]] += from.first[i + 1] - from.first[i];
  }
  for (unsigned s = 0; s < 2; ++s) make_room(sides[s], whole, nodes[s], edges[s]);
  const std::vector<uint32_t> number = take_nodes(whole, right, sides);
  std::array<uint32_t, 2> edge{};
  for (uint32_t i = 0; i < from.size(); ++i) {
    const uint8_t s = right[i];
    SpatialGraph& to = sides[s].graph;
    uint32_t& at = edge[s];
    for (uint32_t a = from.first[i]; a < from.first[i + 1]; ++a) {
      const uint32_t neighbour = from.neighbour[a];
      // What was cut is written over.
      to.neighbour[at] = number[neighbour];
      if (!from.edge_weight.empty()) to.edge_weight[at] = from.edge_weight[a];
      at += right[neighbour] == s;
    }
    to.first[number[i] + 1] = at;
  }
  for (unsigned s = 0; s < 2; ++s) {
    sides[s].graph.neighbour.resize(edge[s]);
    if (!from.edge_weight.empty()) sides[s].graph.edge_weight.resize(edge[s]);
  }
  return sides;
}

Subset whole_graph(const SpatialGraph& graph, uint64_t target) {
  Subset subset;
  if (graph.size() >= least_clustered) {
    ClusteredNodes clustered = cluster_nodes(graph, cluster_size);
    subset.graph = reordered(graph, clustered.order);
    subset.nodes = std::move(clustered.order);
    subset.cluster = std::move(clustered.cluster);
  } else {
    subset.graph = graph;
    subset.nodes.resize(graph.size());
    std::iota(subset.nodes.begin(), subset.nodes.end(), 0u);
  }
  for (uint32_t i = 0; i < graph.size(); ++i) subset.weight += graph.weight(i);
  const uint64_t parts = std::max<uint64_t>(1, (subset.weight + target / 2) / target);
  subset.parts = static_cast<uint32_t>(std::min<uint64_t>(parts, graph.size()));
  return subset;
}

bool is_part(const Subset& subset) {
  return subset.parts <= 1 || subset.nodes.size() <= 1;
}

/// What becomes of a subset in one step: itself, or its two sides.
std::vector<Subset> cut_once(Subset subset, const CutOptions& options) {
  std::vector<Subset> result;
  if (is_part(subset)) {
    result.push_back(std::move(subset));
    return result;
  }
  const Balance balance = balance_of(subset, options.slack);
  TwoSides sides = subset.cluster.empty() ? cut_in_two(subset.graph, balance, options.axes, of_nodes)
                                          : cut_clusters(subset, balance, options.axes);
  ensure_two_sides(sides);
  std::array<Subset, 2> both = take_sides(subset, sides.right);
  both[0].parts = subset.parts / 2;
  both[1].parts = subset.parts - subset.parts / 2;
  for (Subset& side : both) result.push_back(std::move(side));
  return result;
}

}  // namespace

std::vector<uint32_t> cut_into_parts(const SpatialGraph& graph, const CutOptions& options,
                                     Executor& executor) {
  std::vector<uint32_t> part_of(graph.size());
  std::vector<Subset> subsets;
  if (graph.size() > 0) subsets.push_back(whole_graph(graph, options.target));
  // In the order of the tree of cuts, all of one depth at once.
  while (!std::all_of(subsets.begin(), subsets.end(), is_part)) {
    std::vector<std::vector<Subset>> sides(subsets.size());
    executor.parallel_for(subsets.size(),
                          [&](size_t i) { sides[i] = cut_once(std::move(subsets[i]), options); });
    subsets.clear();
    for (std::vector<Subset>& both : sides) {
      for (Subset& side : both) {
        if (is_part(side)) side.graph = {};
        subsets.push_back(std::move(side));
      }
    }
  }
  for (uint32_t part = 0; part < subsets.size(); ++part) {
    for (const uint32_t node : subsets[part].nodes) part_of[node] = part;
  }
  return part_of;
}

}  // namespace maille
