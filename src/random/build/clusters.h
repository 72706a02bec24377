#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "random/build/spatial_graph.h"

namespace maille {

// A graph of a few hundred thousand faces is cut as one of some ten thousand clusters first: what cuts look
// for is far larger than a face.

/// Nodes in an order in which each cluster stands together.
struct ClusteredNodes {
  std::vector<uint32_t> order;
  std::vector<uint32_t> cluster;  ///< by place in the order: rising from 0
};
/// Clusters of at most `size` nodes that hang together, grown breadth first one beside the other; those that
/// fill what is left between others are smaller. A cluster does not reach over two components.
ClusteredNodes cluster_nodes(const SpatialGraph& graph, uint32_t size);

/// The graph with nodes in another order.
SpatialGraph reordered(const SpatialGraph& graph, std::span<const uint32_t> order);

/// The clusters as nodes, where they lie in the mean, with the edges between them. `cluster`: by node, rising
/// from 0.
SpatialGraph contracted(const SpatialGraph& graph, std::span<const uint32_t> cluster);

}  // namespace maille
