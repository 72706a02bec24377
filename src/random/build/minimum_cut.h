#pragma once

#include <cstdint>
#include <vector>

#include "random/build/spatial_graph.h"

namespace maille {

/// A graph cut in two. Weights are of nodes, `cut` is of edges.
struct TwoSides {
  std::vector<uint8_t> right;  ///< by node: on the right side?
  uint64_t left_weight = 0;
  uint64_t cut = 0;
};

/// The weight on the left side that is wished for, and what is allowed.
struct Balance {
  uint64_t wished, least, most;
};

/// Weighs both sides of `right`.
TwoSides weigh_sides(const SpatialGraph& graph, std::vector<uint8_t> right);

/// Replaces a cut by a minimum cut within a band around it. The band is as wide as the balance allows for any
/// cut in it, and holds `factor` times as many nodes as the cut is long at most: so the result is balanced
/// without repair. The nodes that a maximum flow (Dinic 1970) leaves reachable from the source are the same
/// for every maximum flow, so the cut does not depend on the order of paths. True if the cut became smaller.
class BandCut {
 public:
  explicit BandCut(const SpatialGraph& graph);
  bool improve(TwoSides& sides, const Balance& balance, uint32_t factor);

 private:
  static constexpr uint32_t outside = 0xffffffff;
  struct Arc {
    uint32_t to, reverse;
    uint32_t capacity;
  };

  void find_band(const TwoSides& sides, const Balance& balance, uint32_t factor);
  void grow_side(const TwoSides& sides, const std::vector<uint32_t>& seeds, uint8_t side, uint64_t budget);
  void build_network(const TwoSides& sides);
  void pair_arcs();
  bool find_levels();
  uint32_t augment(uint32_t start);
  uint64_t maximum_flow();
  std::vector<uint8_t> reachable_from_source() const;
  std::vector<uint8_t> cannot_reach_sink() const;
  void apply(TwoSides& sides, const Balance& balance, uint64_t flow);

  const SpatialGraph& graph_;
  uint64_t mean_weight_ = 1;
  std::vector<uint32_t> index_;  ///< by node: in the band, or `outside`
  std::vector<uint32_t> band_;   ///< nodes
  std::vector<uint32_t> first_arc_, current_, level_, queue_, path_;
  std::vector<Arc> arcs_;
  std::vector<uint32_t> from_source_, to_sink_;  ///< by place in the band: capacity left
  uint64_t fixed_cut_ = 0;                       ///< edges that are cut whatever happens in the band
};

}  // namespace maille
