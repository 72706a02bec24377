#pragma once

#include <maille/error.h>
#include <maille/limits.h>
#include <maille/source.h>
#include <cstdint>
#include <vector>

#include "surface/half_edges.h"

namespace maille {

/// What both sides know before the first symbol. docs/format.md, 14.2.
struct ConnectivityHeader {
  uint32_t components = 0;
  uint32_t regular_valence = 6;  ///< the most frequent one; other valences are coded relative to it
  uint32_t regular_degree = 3;   ///< of faces, likewise
  bool uniform_degree = true;    ///< every face has the regular degree
  bool has_border = false;
};

/// The vertices of a closed surface in the order in which the traversal meets them. Where several fans of
/// faces meet in one point of the mesh, each fan has a vertex of its own. (The dummies of border loops are
/// numbered apart, from first_dummy.)
struct SurfaceVertices {
  std::vector<uint32_t> corner;  ///< a half-edge out of each vertex: the first one the traversal meets
  uint32_t size() const { return static_cast<uint32_t>(corner.size()); }
};

/// What encode_connectivity() gives. On return `surface.origin` holds numbers of SurfaceVertices; `points`
/// gives for each of them the number that it had in `origin` before. `first_half_edges` lists the faces in
/// coded order, border triangles included.
struct CodedConnectivity {
  ConnectivityHeader header;
  SurfaceVertices vertices;
  std::vector<uint32_t> points;
  std::vector<uint32_t> first_half_edges;
  std::vector<std::byte> bytes;
};
/// Codes a closed surface, whose first `real_half_edges` half-edges belong to real faces; origins from
/// `point_count` on are dummies. No errors. Time is linear but for splits, see FrontCoder::node_behind().
CodedConnectivity encode_connectivity(HalfEdges& surface, uint32_t real_half_edges, uint32_t point_count);

/// Faces in coded order, border triangles among them; half-edges of a face follow one another.
struct DecodedConnectivity {
  HalfEdges surface;
  SurfaceVertices vertices;
};
/// Inverse of encode_connectivity(). Safe on any bytes: a closed surface or corrupt; work and memory are
/// bounded by the bytes given and by max_half_edges. `expected_half_edges` only says how much room to reserve
/// at first.
Result<DecodedConnectivity> decode_connectivity(const ConnectivityHeader& header, Bytes bytes,
                                                uint32_t max_half_edges, uint32_t expected_half_edges);

}  // namespace maille
