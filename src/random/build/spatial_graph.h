#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace maille {

/// An undirected graph whose nodes lie in space: faces joined by shared edges, or charts joined by shared
/// borders. Neighbours of node i are neighbour[first[i]] ... neighbour[first[i + 1] - 1]; each edge stands
/// there from both ends, with the same weight.
struct SpatialGraph {
  std::vector<uint32_t> first;
  std::vector<uint32_t> neighbour;
  std::vector<uint32_t> edge_weight;  ///< by place in `neighbour`; empty: all 1
  std::vector<uint32_t> node_weight;  ///< by node; empty: all 1
  std::vector<std::array<float, 3>> place;

  uint32_t size() const { return static_cast<uint32_t>(place.size()); }
  uint32_t weight(uint32_t node) const { return node_weight.empty() ? 1 : node_weight[node]; }
  uint32_t weight_of_edge(uint32_t at) const { return edge_weight.empty() ? 1 : edge_weight[at]; }
};

/// Faces as lists of vertices; the corners of face i are corners[first[i]] ... corners[first[i + 1] - 1].
struct FaceLists {
  std::span<const uint32_t> corners;
  std::span<const uint32_t> first;  ///< faces + 1; empty: triangles

  uint32_t size() const {
    return static_cast<uint32_t>(first.empty() ? corners.size() / 3 : first.size() - 1);
  }
  std::span<const uint32_t> face(uint32_t i) const {
    return first.empty() ? corners.subspan(size_t{3} * i, 3)
                         : corners.subspan(first[i], first[i + 1] - first[i]);
  }
};

/// The faces as nodes, at the mean of their corners, joined where they share an edge: the k faces at one edge
/// are a chain in the order of their numbers, so non-manifold edges need no special case. A face weighs as
/// many triangles as it can be cut into. `positions`: three numbers a vertex. Time and memory are linear.
SpatialGraph dual_graph(const FaceLists& faces, std::span<const float> positions, uint32_t vertices);

}  // namespace maille
