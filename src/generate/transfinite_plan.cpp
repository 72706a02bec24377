#include <algorithm>
#include <numeric>
#include <tuple>

#include "generate/transfinite_order.h"

namespace maille {

SweepPlan plan_block_by_block(const BlockTopology& topology) {
  SweepPlan plan;
  for (uint32_t b = 0; b < topology.divisions.size(); ++b) {
    plan.sweeps.push_back({{{.block = b}}, topology.divisions[b][2]});
  }
  return plan;
}

namespace {

/// Axes of blocks that run side by side, as classes: all have the same number of cells. A union of sets, with
/// the turn of each axis against its parent.
class Directions {
 public:
  explicit Directions(const BlockTopology& topology) : parent_(3 * topology.divisions.size()) {
    std::iota(parent_.begin(), parent_.end(), 0u);
    turned_.resize(parent_.size());
    for (uint32_t b = 0; b < topology.divisions.size(); ++b) {
      for (unsigned f = 0; f < 6; ++f) {
        const auto& n = topology.neighbours[b][f];
        for (unsigned a = 0; n.block >= 0 && a < 3; ++a) {
          if (a != f / 2) join(3 * b + a, 3 * static_cast<uint32_t>(n.block) + n.axis[a], n.flipped[a]);
        }
      }
    }
  }

  /// A member of the class, and whether the axis runs against it.
  std::pair<uint32_t, bool> find(uint32_t x) const {
    bool turned = false;
    while (parent_[x] != x) {
      turned = turned != turned_[x];
      x = parent_[x];
    }
    return {x, turned};
  }

 private:
  // Two ways that disagree (a Moebius strip) leave the first one; keeps_step() checks the plan for that
  // later.
  void join(uint32_t x, uint32_t y, bool flipped) {
    const auto [rx, tx] = find(x);
    const auto [ry, ty] = find(y);
    if (rx == ry) return;
    const uint32_t low = std::min(rx, ry);
    const uint32_t high = std::max(rx, ry);
    parent_[high] = low;
    turned_[high] = (tx != ty) != flipped;
  }

  std::vector<uint32_t> parent_;
  std::vector<bool> turned_;
};

// Two steps: gather() chooses directions and so sweeps, order() puts sweeps one after the other. Both are
// greedy, and ties go to the lower number, so that the plan is the same everywhere.
class Planner {
 public:
  explicit Planner(const BlockTopology& topology) : t_(topology), directions_(topology) {}

  SweepPlan plan() {
    gather();
    order();
    return std::move(plan_);
  }

 private:
  using Sweep = SweepPlan::Sweep;

  // A class of directions sweeps the blocks that are not taken yet; those whose cross-section is smallest go
  // first. Each round takes a block at least, so it ends.
  void gather() {
    const size_t blocks = t_.divisions.size();
    std::vector<bool> taken(blocks, false);
    for (size_t left = blocks; left > 0;) {
      std::vector<uint64_t> section(3 * blocks, 0);
      for (uint32_t b = 0; b < blocks; ++b) {
        for (unsigned a = 0; !taken[b] && a < 3; ++a)
          section[directions_.find(3 * b + a).first] += area(b, a);
      }
      // A direction is judged by what it asks of memory for each layer it goes.
      uint32_t best = 0;
      double least = 0;
      for (uint32_t c = 0; c < section.size(); ++c) {
        if (section[c] == 0) continue;
        const double cost = static_cast<double>(section[c]) / static_cast<double>(t_.divisions[c / 3][c % 3]);
        if (least == 0 || cost < least) {
          best = c;
          least = cost;
        }
      }
      take(best, taken, left);
    }
  }

  uint64_t area(uint32_t block, unsigned axis) const {
    const auto& n = t_.divisions[block];
    return (uint64_t{n[(axis + 1) % 3]} + 1) * (uint64_t{n[(axis + 2) % 3]} + 1);
  }

  void take(uint32_t direction, std::vector<bool>& taken, size_t& left) {
    Sweep sweep;
    sweep.layers = t_.divisions[direction / 3][direction % 3];
    for (uint32_t b = 0; b < taken.size(); ++b) {
      for (unsigned a = 0; !taken[b] && a < 3; ++a) {
        const auto [root, turned] = directions_.find(3 * b + a);
        if (root != direction) continue;
        sweep.blocks.push_back(swept(b, a, turned));
        taken[b] = true;
        --left;
      }
    }
    if (keeps_step(sweep)) {
      sweeps_.push_back(std::move(sweep));
      return;
    }
    for (const SweepPlan::Block& block : sweep.blocks) sweeps_.push_back({{block}, sweep.layers});
  }

  static SweepPlan::Block swept(uint32_t block, unsigned axis, bool backwards) {
    SweepPlan::Block b;
    b.block = block;
    b.axis = {static_cast<uint8_t>(axis == 0 ? 1 : 0), static_cast<uint8_t>(axis == 2 ? 1 : 2),
              static_cast<uint8_t>(axis)};
    b.backwards = backwards;
    return b;
  }

  // Points shared within a sweep must be in the same layer of all blocks, or in the first or last ones only.
  // Otherwise a point would be wanted before its owner has made it; such a sweep falls apart into its blocks.
  bool keeps_step(const Sweep& sweep) const {
    std::vector<const SweepPlan::Block*> inside(t_.divisions.size(), nullptr);
    for (const SweepPlan::Block& b : sweep.blocks) inside[b.block] = &b;
    for (const SweepPlan::Block& b : sweep.blocks) {
      for (uint32_t i = 0; i < BlockTopology::nodes_per_block; ++i) {
        const uint32_t node = b.block * BlockTopology::nodes_per_block + i;
        for (const uint32_t other : t_.entities[t_.nodes[node].entity]) {
          const SweepPlan::Block* o = inside[other / BlockTopology::nodes_per_block];
          if (o != nullptr && layer_parameter(node, b) != layer_parameter(other, *o)) return false;
        }
      }
    }
    return true;
  }

  /// Which parameter of its entity goes from layer to layer, and in which direction.
  std::pair<int, bool> layer_parameter(uint32_t node, const SweepPlan::Block& b) const {
    const BlockTopology::Node& map = t_.nodes[node];
    const int parameter = map.parameter[b.axis[2]];
    return {parameter, parameter >= 0 && map.flipped[b.axis[2]] != b.backwards};
  }

  // Greedy: next comes the sweep which leaves the fewest points waiting for others.
  void order() {
    sweep_of_.resize(t_.divisions.size());
    for (uint32_t s = 0; s < sweeps_.size(); ++s) {
      for (const SweepPlan::Block& b : sweeps_[s].blocks) sweep_of_[b.block] = s;
    }
    done_.assign(sweeps_.size(), false);
    for (size_t left = sweeps_.size(); left > 0; --left) {
      int64_t least = 0;
      uint32_t next = static_cast<uint32_t>(sweeps_.size());
      for (uint32_t s = 0; s < sweeps_.size(); ++s) {
        if (done_[s]) continue;
        const int64_t growth = opened(s);
        if (next == sweeps_.size() || growth < least) {
          next = s;
          least = growth;
        }
      }
      turn(sweeps_[next], next);
      done_[next] = true;
      plan_.sweeps.push_back(sweeps_[next]);
    }
  }

  /// Points on faces to sweeps to come, less those on faces to sweeps that are done.
  int64_t opened(uint32_t sweep) const {
    int64_t sum = 0;
    for (const SweepPlan::Block& b : sweeps_[sweep].blocks) {
      for (unsigned f = 0; f < 6; ++f) {
        const int32_t n = t_.neighbours[b.block][f].block;
        if (n < 0 || sweep_of_[static_cast<uint32_t>(n)] == sweep) continue;
        const auto points = static_cast<int64_t>(area(b.block, f / 2));
        sum += done_[sweep_of_[static_cast<uint32_t>(n)]] ? -points : points;
      }
    }
    return sum;
  }

  // The end that meets what is done goes first, so that points that wait there end early.
  void turn(Sweep& sweep, uint32_t number) const {
    int64_t ahead = 0;
    for (const SweepPlan::Block& b : sweep.blocks) {
      for (unsigned end = 0; end < 2; ++end) {
        const int32_t n = t_.neighbours[b.block][2 * b.axis[2] + end].block;
        if (n < 0 || sweep_of_[static_cast<uint32_t>(n)] == number) continue;
        const bool first = (end == 1) == b.backwards;
        const auto points = static_cast<int64_t>(area(b.block, b.axis[2]));
        ahead += first == done_[sweep_of_[static_cast<uint32_t>(n)]] ? points : -points;
      }
    }
    if (ahead >= 0) return;
    for (SweepPlan::Block& b : sweep.blocks) b.backwards = !b.backwards;
  }

  const BlockTopology& t_;
  Directions directions_;
  std::vector<Sweep> sweeps_;
  std::vector<uint32_t> sweep_of_;
  std::vector<bool> done_;
  SweepPlan plan_;
};

}  // namespace

SweepPlan plan_streaming(const BlockTopology& topology) {
  // Planning takes the square of the number of blocks. 4096 was chosen, not swept.
  if (topology.divisions.size() > 4096) return plan_block_by_block(topology);
  return Planner(topology).plan();
}

}  // namespace maille
