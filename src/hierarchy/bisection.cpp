#include "hierarchy/bisection.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "hierarchy/minimum_cut.h"
#include "hierarchy/principal_axes.h"

namespace maille {
namespace {

/// Some nodes of the graph, in rising order, with the edges between them.
struct Subset {
  SpatialGraph graph;
  std::vector<uint32_t> nodes;  ///< numbers in the whole graph
  uint64_t weight = 0;
  uint32_t parts = 1;
};

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

/// One cut of each start in a narrow band, and two more of the better one in a wide band.
TwoSides cut_in_two(const Subset& subset, const CutOptions& options) {
  const SpatialGraph& graph = subset.graph;
  const Balance balance = balance_of(subset, options.slack);
  const auto axes = principal_axes(graph);
  const std::vector<float> along = projections(graph, axes[0]);
  BandCut band(graph);
  std::optional<TwoSides> best;
  const auto offer = [&](std::vector<uint8_t> right) {
    TwoSides sides = weigh_sides(graph, std::move(right));
    band.improve(sides, balance, 8);
    if (!best || sides.cut < best->cut) best = std::move(sides);
  };
  offer(split_along(graph, along, balance.wished));
  for (unsigned k = 1; k < options.axes; ++k) {
    offer(split_along(graph, projections(graph, axes[k]), balance.wished));
  }
  offer(split_by_growth(graph, along, balance.wished));
  for (unsigned round = 0; round < 2; ++round) {
    if (!band.improve(*best, balance, 16)) break;
  }
  return std::move(*best);
}

/// Halves the list where no cut leaves nodes on both sides.
void ensure_two_sides(TwoSides& sides) {
  const auto rights = std::count(sides.right.begin(), sides.right.end(), uint8_t{1});
  if (rights != 0 && static_cast<size_t>(rights) != sides.right.size()) return;
  for (size_t i = 0; i < sides.right.size(); ++i) sides.right[i] = i >= sides.right.size() / 2;
}

Subset take_side(const Subset& whole, const std::vector<uint8_t>& right, uint8_t side,
                 std::vector<uint32_t>& number) {
  Subset subset;
  const SpatialGraph& from = whole.graph;
  SpatialGraph& to = subset.graph;
  size_t nodes = 0, edges = 0;
  for (uint32_t i = 0; i < from.size(); ++i) {
    const bool here = right[i] == side;
    nodes += here;
    edges += here ? from.first[i + 1] - from.first[i] : 0;
  }
  to.place.reserve(nodes);
  subset.nodes.reserve(nodes);
  // All but those that were cut.
  to.neighbour.reserve(edges);
  if (!from.node_weight.empty()) to.node_weight.reserve(nodes);
  if (!from.edge_weight.empty()) to.edge_weight.reserve(edges);
  for (uint32_t i = 0; i < from.size(); ++i) {
    if (right[i] != side) continue;
    number[i] = to.size();
    to.place.push_back(from.place[i]);
    if (!from.node_weight.empty()) to.node_weight.push_back(from.node_weight[i]);
    subset.weight += from.weight(i);
    subset.nodes.push_back(whole.nodes[i]);
  }
  to.first.reserve(nodes + 1);
  to.first.push_back(0);
  for (uint32_t i = 0; i < from.size(); ++i) {
    if (right[i] != side) continue;
    for (uint32_t a = from.first[i]; a < from.first[i + 1]; ++a) {
      if (right[from.neighbour[a]] != side) continue;
      to.neighbour.push_back(number[from.neighbour[a]]);
      if (!from.edge_weight.empty()) to.edge_weight.push_back(from.edge_weight[a]);
    }
    to.first.push_back(static_cast<uint32_t>(to.neighbour.size()));
  }
  return subset;
}

Subset whole_graph(const SpatialGraph& graph, uint64_t target) {
  Subset subset;
  subset.graph = graph;
  subset.nodes.resize(graph.size());
  std::iota(subset.nodes.begin(), subset.nodes.end(), 0u);
  for (uint32_t i = 0; i < graph.size(); ++i) subset.weight += graph.weight(i);
  const uint64_t parts = std::max<uint64_t>(1, (subset.weight + target / 2) / target);
  subset.parts = static_cast<uint32_t>(std::min<uint64_t>(parts, graph.size()));
  return subset;
}

}  // namespace

std::vector<uint32_t> cut_into_parts(const SpatialGraph& graph, const CutOptions& options) {
  std::vector<uint32_t> part_of(graph.size());
  std::vector<uint32_t> number(graph.size());
  std::vector<Subset> waiting;
  if (graph.size() > 0) waiting.push_back(whole_graph(graph, options.target));
  for (uint32_t parts = 0; !waiting.empty();) {
    const Subset subset = std::move(waiting.back());
    waiting.pop_back();
    if (subset.parts <= 1 || subset.nodes.size() <= 1) {
      for (const uint32_t node : subset.nodes) part_of[node] = parts;
      ++parts;
      continue;
    }
    TwoSides sides = cut_in_two(subset, options);
    ensure_two_sides(sides);
    waiting.push_back(take_side(subset, sides.right, 1, number));
    waiting.back().parts = subset.parts - subset.parts / 2;
    waiting.push_back(take_side(subset, sides.right, 0, number));
    waiting.back().parts = subset.parts / 2;
  }
  return part_of;
}

}  // namespace maille
