#include "random/build/minimum_cut.h"

#include <algorithm>

namespace maille {
namespace {

uint64_t left_weight(const SpatialGraph& graph, const std::vector<uint8_t>& right) {
  uint64_t weight = 0;
  for (uint32_t i = 0; i < graph.size(); ++i) weight += right[i] ? 0 : graph.weight(i);
  return weight;
}

uint64_t distance(uint64_t a, uint64_t b) {
  return a < b ? b - a : a - b;
}

}  // namespace

// Each cut edge is counted once, from its left end.
TwoSides weigh_sides(const SpatialGraph& graph, std::vector<uint8_t> right) {
  TwoSides sides;
  sides.left_weight = left_weight(graph, right);
  for (uint32_t i = 0; i < graph.size(); ++i) {
    if (right[i]) continue;
    for (uint32_t a = graph.first[i]; a < graph.first[i + 1]; ++a) {
      if (right[graph.neighbour[a]]) sides.cut += graph.weight_of_edge(a);
    }
  }
  sides.right = std::move(right);
  return sides;
}

BandCut::BandCut(const SpatialGraph& graph) : graph_(graph), index_(graph.size(), outside) {
  uint64_t sum = 0;
  for (const uint32_t weight : graph.node_weight) sum += weight;
  if (sum > 0) mean_weight_ = std::max<uint64_t>(1, sum / graph.size());
}

// A minimum cut within the band (Dinic 1970) is the best cut that moves nodes of the band only; so the cut
// never becomes longer.
bool BandCut::improve(TwoSides& sides, const Balance& balance, uint32_t factor) {
  find_band(sides, balance, factor);
  bool better = false;
  if (!band_.empty()) {
    build_network(sides);
    const uint64_t flow = maximum_flow();
    better = flow + fixed_cut_ < sides.cut;
    if (better) apply(sides, balance, flow);
  }
  for (const uint32_t node : band_) index_[node] = outside;
  return better;
}

void BandCut::find_band(const TwoSides& sides, const Balance& balance, uint32_t factor) {
  std::vector<uint32_t> seeds;
  for (uint32_t i = 0; i < graph_.size(); ++i) {
    bool on_cut = false;
    for (uint32_t a = graph_.first[i]; a < graph_.first[i + 1] && !on_cut; ++a) {
      on_cut = sides.right[graph_.neighbour[a]] != sides.right[i];
    }
    if (on_cut) seeds.push_back(i);
  }
  // Half of the band lies on each side. The 64 keep short cuts from having a band in which nothing can move.
  const uint64_t widest = (uint64_t{factor} * seeds.size() / 2 + 64) * mean_weight_;
  const auto room = [widest](uint64_t from, uint64_t to) {
    return from < to ? std::min(to - from, widest) : 0;
  };
  band_.clear();
  grow_side(sides, seeds, 0, room(balance.least, sides.left_weight));
  grow_side(sides, seeds, 1, room(sides.left_weight, balance.most));
}

/// Grows the band breadth first from the cut. Whatever cut is found within it, at most the nodes of the band
/// change sides; since these weigh `budget` at most, every such cut is balanced.
void BandCut::grow_side(const TwoSides& sides, const std::vector<uint32_t>& seeds, uint8_t side,
                        uint64_t budget) {
  const auto take = [&](uint32_t node) {
    if (index_[node] != outside || sides.right[node] != side || graph_.weight(node) > budget) return;
    budget -= graph_.weight(node);
    index_[node] = static_cast<uint32_t>(band_.size());
    band_.push_back(node);
  };
  const size_t begin = band_.size();
  for (const uint32_t seed : seeds) take(seed);
  for (size_t next = begin; next < band_.size(); ++next) {
    const uint32_t node = band_[next];
    for (uint32_t a = graph_.first[node]; a < graph_.first[node + 1]; ++a) take(graph_.neighbour[a]);
  }
}

/// Nodes outside the band are the source (left) or the sink (right).
void BandCut::build_network(const TwoSides& sides) {
  fixed_cut_ = sides.cut;
  from_source_.assign(band_.size(), 0);
  to_sink_.assign(band_.size(), 0);
  first_arc_.assign(band_.size() + 1, 0);
  arcs_.clear();
  for (uint32_t i = 0; i < band_.size(); ++i) {
    const uint32_t node = band_[i];
    for (uint32_t a = graph_.first[node]; a < graph_.first[node + 1]; ++a) {
      const uint32_t other = graph_.neighbour[a], to = index_[other], weight = graph_.weight_of_edge(a);
      const bool cut = sides.right[node] != sides.right[other];
      // Cut edges within the band are seen from both ends.
      if (cut && (to == outside || i < to)) fixed_cut_ -= weight;
      if (to != outside) {
        arcs_.push_back({to, outside, weight});
      } else {
        (sides.right[other] ? to_sink_ : from_source_)[i] += weight;
      }
    }
    first_arc_[i + 1] = static_cast<uint32_t>(arcs_.size());
  }
  pair_arcs();
}

/// Finds the reverse arc of each arc. Both ends list their arcs, so pairs are found without a hash table, and
/// the same ones on every machine.
void BandCut::pair_arcs() {
  // Arcs before this place are paired; every edge stands at both of its ends.
  current_.assign(first_arc_.begin(), first_arc_.end() - 1);
  const auto is_paired = [this](uint32_t a) { return arcs_[a].reverse != outside; };
  for (uint32_t i = 0; i < band_.size(); ++i) {
    for (uint32_t a = first_arc_[i]; a < first_arc_[i + 1]; ++a) {
      if (is_paired(a)) continue;
      uint32_t& unpaired = current_[arcs_[a].to];
      while (is_paired(unpaired)) ++unpaired;
      uint32_t b = unpaired;
      while (arcs_[b].to != i || is_paired(b)) ++b;
      arcs_[a].reverse = b;
      arcs_[b].reverse = a;
    }
  }
}

/// Distances from the source. False when the sink cannot be reached.
bool BandCut::find_levels() {
  level_.assign(band_.size(), outside);
  queue_.clear();
  for (uint32_t i = 0; i < band_.size(); ++i) {
    if (from_source_[i] == 0) continue;
    level_[i] = 0;
    queue_.push_back(i);
  }
  bool reached = false;
  for (size_t next = 0; next < queue_.size(); ++next) {
    const uint32_t i = queue_[next];
    reached = reached || to_sink_[i] > 0;
    for (uint32_t a = first_arc_[i]; a < first_arc_[i + 1]; ++a) {
      const Arc& arc = arcs_[a];
      if (arc.capacity == 0 || level_[arc.to] != outside) continue;
      level_[arc.to] = level_[i] + 1;
      queue_.push_back(arc.to);
    }
  }
  return reached;
}

/// Sends flow along one path from `start`, which has capacity from the source, along rising levels; returns
/// how much, and 0 if there is no path. A node from which the sink cannot be reached loses its level and is
/// not visited again in this phase, which is what bounds Dinic's algorithm.
uint32_t BandCut::augment(uint32_t start) {
  path_.clear();
  uint32_t node = start;
  for (;;) {
    if (to_sink_[node] > 0) break;
    uint32_t& a = current_[node];
    while (a < first_arc_[node + 1] && (arcs_[a].capacity == 0 || level_[arcs_[a].to] != level_[node] + 1))
      ++a;
    if (a < first_arc_[node + 1]) {
      path_.push_back(a);
      node = arcs_[a].to;
      continue;
    }
    level_[node] = outside;
    if (path_.empty()) return 0;
    const uint32_t back = arcs_[path_.back()].reverse;
    path_.pop_back();
    node = arcs_[back].to;
  }
  uint32_t flow = std::min(from_source_[start], to_sink_[node]);
  for (const uint32_t a : path_) flow = std::min(flow, arcs_[a].capacity);
  from_source_[start] -= flow;
  to_sink_[node] -= flow;
  for (const uint32_t a : path_) {
    arcs_[a].capacity -= flow;
    arcs_[arcs_[a].reverse].capacity += flow;
  }
  return flow;
}

// Each phase lengthens the shortest paths from source to sink, so there are at most as many phases as nodes
// (Dinic 1970); in bands of a few rows there are few.
uint64_t BandCut::maximum_flow() {
  uint64_t total = 0;
  while (find_levels()) {
    current_.assign(first_arc_.begin(), first_arc_.end() - 1);
    for (uint32_t i = 0; i < band_.size(); ++i) {
      while (from_source_[i] > 0 && level_[i] == 0) {
        const uint32_t flow = augment(i);
        if (flow == 0) break;
        total += flow;
      }
    }
  }
  return total;
}

std::vector<uint8_t> BandCut::reachable_from_source() const {
  // The last find_levels() has seen just these.
  std::vector<uint8_t> left(band_.size());
  for (size_t i = 0; i < band_.size(); ++i) left[i] = level_[i] != outside;
  return left;
}

/// The largest left side of a minimum cut. reachable_from_source() is the smallest one, and both are the same
/// for every maximum flow.
std::vector<uint8_t> BandCut::cannot_reach_sink() const {
  std::vector<uint8_t> left(band_.size(), 1);
  std::vector<uint32_t> queue;
  for (uint32_t i = 0; i < band_.size(); ++i) {
    if (to_sink_[i] == 0) continue;
    left[i] = 0;
    queue.push_back(i);
  }
  for (size_t next = 0; next < queue.size(); ++next) {
    const uint32_t i = queue[next];
    for (uint32_t a = first_arc_[i]; a < first_arc_[i + 1]; ++a) {
      const uint32_t from = arcs_[a].to;
      if (!left[from] || arcs_[arcs_[a].reverse].capacity == 0) continue;
      left[from] = 0;
      queue.push_back(from);
    }
  }
  return left;
}

/// Takes the smallest or the largest left side, whichever weighs nearer to what is wished for.
void BandCut::apply(TwoSides& sides, const Balance& balance, uint64_t flow) {
  const auto weight_of = [&](const std::vector<uint8_t>& left) {
    uint64_t weight = sides.left_weight;
    for (size_t i = 0; i < band_.size(); ++i) {
      const uint32_t node = band_[i];
      if (left[i] && sides.right[node]) weight += graph_.weight(node);
      if (!left[i] && !sides.right[node]) weight -= graph_.weight(node);
    }
    return weight;
  };
  std::vector<uint8_t> left = reachable_from_source();
  uint64_t weight = weight_of(left);
  std::vector<uint8_t> largest = cannot_reach_sink();
  const uint64_t largest_weight = weight_of(largest);
  if (distance(largest_weight, balance.wished) < distance(weight, balance.wished)) {
    left = std::move(largest);
    weight = largest_weight;
  }
  for (size_t i = 0; i < band_.size(); ++i) sides.right[band_[i]] = left[i] ? 0 : 1;
  sides.left_weight = weight;
  sides.cut = flow + fixed_cut_;
}

}  // namespace maille
