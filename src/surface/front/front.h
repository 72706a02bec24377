#pragma once

#include <cstdint>
#include <vector>

#include "surface/half_edges.h"

namespace maille {

/// One vertex on the front between coded and uncoded faces. A vertex may be on the front more than once.
struct FrontNode {
  uint32_t vertex;
  uint32_t edge;  ///< half-edge of a coded face, from the next node's vertex to this one's
  uint32_t next;  ///< none: the node is not in use
  uint32_t previous;
  uint32_t free;  ///< edges of the vertex in the gap of this node that no coded face has yet
};

/// The front: cyclic lists of nodes. Splitting one list and merging two are the same operation on the links,
/// so no list has an identity of its own; `pending` holds one node of each list that waits. Node numbers are
/// the same in encoder and decoder, since both do the same operations in the same order.
class Front {
 public:
  FrontNode& operator[](uint32_t node) { return nodes_[node]; }
  const FrontNode& operator[](uint32_t node) const { return nodes_[node]; }
  uint32_t slots() const { return static_cast<uint32_t>(nodes_.size()); }
  bool alive(uint32_t node) const { return nodes_[node].next != none; }

  /// A node that is linked to itself only.
  uint32_t create(uint32_t vertex, uint32_t edge, uint32_t free);
  void link(uint32_t a, uint32_t b) {
    nodes_[a].next = b;
    nodes_[b].previous = a;
  }
  /// Takes a node out of use; its neighbours must be linked past it by the caller.
  void remove(uint32_t node) {
    nodes_[node].next = none;
    unused_.push_back(node);
  }
  void remember(uint32_t node) { pending_.push_back(node); }
  /// A node of a list that waits; none when there is no list left. A merge leaves the pending node of the
  /// merged list behind, dead or alive in another list: either way every list that waits has its own pending
  /// node.
  uint32_t take_pending();

 private:
  std::vector<FrontNode> nodes_;
  std::vector<uint32_t> unused_;
  std::vector<uint32_t> pending_;
};

}  // namespace maille
