#include "surface/patch_topology.h"

namespace maille {
namespace {

/// Triangles of one block, nothing loose or turned over, no arrays that need places.
bool is_plain(const PatchTopology& topology, std::span<const BlockShape> blocks, bool with_places) {
  return blocks.size() == 1 && blocks[0].type == CellType::triangle &&
         topology.surface.half_edges.all_triangles() && topology.flipped.empty() &&
         topology.loose.size() == 0 && !with_places;
}

/// The points of half-edges, by way of their vertices where these differ. Raw pointers, so that the loop over
/// all corners asks once whether there is a table.
class PointsOfOrigins {
 public:
  explicit PointsOfOrigins(const PatchSurface& surface)
      : origins_(surface.half_edges.origin.data()),
        points_(surface.point_of.empty() ? nullptr : surface.point_of.data()) {}
  uint32_t operator()(uint32_t h) const { return points_ == nullptr ? origins_[h] : points_[origins_[h]]; }

 private:
  const uint32_t* origins_;
  const uint32_t* points_;
};

/// The corners of a surface of triangles in coded order, without what blocks, loose cells and flips would
/// need.
std::vector<uint32_t> plain_connectivity(PatchSurface& surface) {
  HalfEdges& edges = surface.half_edges;
  // In the simplest case the origins are the connectivity.
  if (surface.faces.empty() && 3 * surface.face_count == edges.size() && surface.point_of.empty())
    return std::move(edges.origin);
  const PointsOfOrigins point(surface);
  std::vector<uint32_t> connectivity(size_t{3} * surface.face_count);
  uint32_t* out = connectivity.data();
  const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
    *out++ = point(a);
    *out++ = point(b);
    *out++ = point(c);
  };
  for (const uint32_t first : surface.faces) add(first, edges.next(first), edges.previous(first));
  if (!surface.faces.empty()) return connectivity;
  for (uint32_t h = 0; h < edges.size(); h += 3) {
    if (!edges.is_border_triangle(h)) add(h, h + 1, h + 2);
  }
  return connectivity;
}

}  // namespace

/// The order within a block is part of the format (12.5): faces in coded order, then loose cells. Faces of
/// several blocks are sorted into lists first, so that each block is written once.
AssembledCells assemble_cells(PatchTopology topology, std::span<const BlockShape> blocks, bool with_places) {
  AssembledCells result;
  const PatchSurface& surface = topology.surface;
  const HalfEdges& edges = surface.half_edges;
  const uint32_t faces = surface.face_count;
  // Cells are made of origins alone, so this memory can go before they take theirs.
  std::vector<uint32_t>().swap(topology.surface.half_edges.opposite);
  if (is_plain(topology, blocks, with_places)) {
    result.blocks.emplace_back().type = CellType::triangle;
    result.blocks[0].connectivity = plain_connectivity(topology.surface);
    return result;
  }

  // Elements of each block, faces first.
  std::vector<std::vector<uint32_t>> cells_of(blocks.size());
  if (blocks.size() > 1) {
    for (uint32_t face = 0; face < faces; ++face) cells_of[topology.block_of_face(face)].push_back(face);
  }
  for (uint32_t i = 0; i < topology.loose.size(); ++i) cells_of[topology.loose.block[i]].push_back(faces + i);

  if (with_places) {
    result.cell_place.assign(topology.elements().cells(), none);
    result.corner_place.assign(topology.elements().corners(), none);
  }
  uint32_t place = 0;
  uint32_t corner_place = 0;
  for (uint32_t b = 0; b < blocks.size(); ++b) {
    CellBlock& block = result.blocks.emplace_back();
    block.type = blocks[b].type;
    const bool varies = nodes_of(block.type) == 0;
    if (varies && blocks[b].cells > 0) block.offsets.push_back(0);
    const auto end_cell = [&](uint32_t element) {
      if (varies) block.offsets.push_back(block.connectivity.size());
      if (with_places) result.cell_place[element] = place;
      ++place;
    };
    const auto add_corner = [&](uint32_t element, uint32_t point) {
      block.connectivity.push_back(point);
      if (with_places) result.corner_place[element] = corner_place;
      ++corner_place;
    };
    const auto add_face = [&](uint32_t face) {
      const uint32_t first = surface.face(face);
      const bool flipped = topology.is_flipped(face);
      uint32_t h = first;
      do {
        add_corner(h, surface.point(edges.origin[h]));
        // A face that was turned over for the surface comes back as it ran in the mesh.
        h = flipped ? edges.previous(h) : edges.next(h);
      } while (h != first);
      end_cell(face);
    };
    const auto add_loose = [&](uint32_t i) {
      if (block.type == CellType::mixed) block.types.push_back(topology.loose.type[i]);
      for (uint32_t k = topology.loose.offsets[i]; k < topology.loose.offsets[i + 1]; ++k) {
        add_corner(edges.size() + k, topology.loose.nodes[k]);
      }
      end_cell(faces + i);
    };
    if (blocks.size() == 1) {
      block.connectivity.reserve(edges.all_triangles() ? size_t{3} * faces : edges.size());
      for (uint32_t face = 0; face < faces; ++face) add_face(face);
    }
    for (const uint32_t element : cells_of[b])
      element < faces ? add_face(element) : add_loose(element - faces);
  }
  return result;
}

}  // namespace maille
