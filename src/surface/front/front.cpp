#include "surface/front/front.h"

namespace maille {

/// Nodes that are not in use are taken again, the last one first, so that the array stays as small as the
/// longest front.
uint32_t Front::create(uint32_t vertex, uint32_t edge, uint32_t free) {
  uint32_t node = slots();
  if (unused_.empty()) {
    nodes_.emplace_back();
  } else {
    node = unused_.back();
    unused_.pop_back();
  }
  nodes_[node] = {vertex, edge, node, node, free};
  return node;
}

uint32_t Front::take_pending() {
  while (!pending_.empty()) {
    const uint32_t node = pending_.back();
    pending_.pop_back();
    if (alive(node)) return node;
  }
  return none;
}

}  // namespace maille
