#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/block_shape.h"
#include "surface/arrays/array_coder.h"
#include "surface/gluing.h"
#include "surface/patch_surface.h"

namespace maille {

/// Cells that are part of no surface: degenerate faces, lines, volumes. Their nodes are numbers of points in
/// coded order.
struct LooseCells {
  std::vector<uint32_t> block;
  std::vector<uint8_t> type;  ///< for blocks of mixed type; else the block's
  std::vector<uint32_t> offsets{0};
  std::vector<uint32_t> nodes;
  uint32_t size() const { return static_cast<uint32_t>(block.size()); }
};

/// Everything about a mesh but its numbers, in coded order. The encoder keeps PatchSources beside it, the
/// decoder assembles cells from it. docs/format.md, 14.1.
struct PatchTopology {
  PatchSurface surface;
  std::vector<bool> flipped;         ///< by face of the surface; empty: none is
  std::vector<uint32_t> face_block;  ///< by face of the surface; empty: all are of block 0
  LooseCells loose;
  uint32_t points = 0;

  PatchElements elements() const {
    return {&surface, points, loose.size(), static_cast<uint32_t>(loose.nodes.size()), &flipped};
  }
  uint32_t block_of_face(uint32_t face) const { return face_block.empty() ? 0 : face_block[face]; }
  bool is_flipped(uint32_t face) const { return !flipped.empty() && flipped[face]; }
};

/// Where the elements of a coded patch come from in the mesh it was made of. Large, so parts that nobody
/// needs are let go of early.
struct PatchSources {
  std::vector<uint32_t> points;        ///< by point in coded order
  uint32_t unused_points = 0;          ///< how many of the last of them no cell has
  std::vector<uint32_t> cells;         ///< by cell in coded order, counted over all blocks
  std::vector<uint32_t> first_corner;  ///< by cell in coded order: connectivity entry of its first corner
  std::vector<uint32_t> corners;       ///< by corner as in PatchElements; none for gaps. Filled on demand.
};

struct EncodedTopology {
  PatchTopology topology;
  PatchSources sources;
  std::vector<std::byte> bytes;
};

/// One patch has fewer corners: border triangles can add three half-edges to each, and half-edges have 31
/// bits.
inline constexpr uint64_t most_patch_corners = uint64_t{1} << 29;
inline constexpr uint64_t most_patch_points = uint64_t{1} << 31;
/// Error: unsupported, for a mesh that is too large for one patch.
Result<> check_patch_size(const Mesh& mesh);

/// The block and the first corner of each cell, cells and corners counted over all blocks.
struct CellTable {
  std::vector<uint32_t> block;
  std::vector<uint32_t> corner;
};
CellTable table_cells(const Mesh& mesh);

/// A part of a stream of patches: its size, then its bytes.
void put_section(ByteWriter& out, Bytes bytes);

/// The faces of a mesh that can be part of a surface, as one list. The mesh must outlive it.
struct SimpleFaces {
  std::vector<uint32_t> corners;
  std::vector<uint32_t> offsets;  ///< empty: triangles
  std::vector<uint32_t> cell;     ///< empty: face i is cell i
  std::span<const uint32_t> all_corners;

  Faces view(uint32_t points) const { return {all_corners, offsets, points}; }
  uint32_t first(uint32_t face) const { return offsets.empty() ? 3 * face : offsets[face]; }
  uint32_t cell_of(uint32_t face) const { return cell.empty() ? face : cell[face]; }
};
/// The simple faces of all blocks, in the order of the mesh. Points into the mesh where nothing has to be
/// left out.
SimpleFaces collect_faces(const Mesh& mesh);

/// Appends the points that are not on the surface: those of other cells in the order of their first use, then
/// those of none. (Not as they come in the mesh: a part of a mesh that is cut again would have them
/// otherwise.)
void append_other_points(const Mesh& mesh, PatchSources& sources);
/// The other cells: appends them to `loose` and to the sources of cells, when those of points are there.
void collect_loose(const Mesh& mesh, PatchTopology& topology, PatchSources& sources);
std::vector<std::byte> encode_loose(const PatchTopology& topology, const Mesh& mesh);
/// Inverse: the cells of each block that its faces on the surface leave over. `offsets`: of the corners of
/// these, where they are known before the surface is. Safe on any bytes.
Result<> decode_loose(Bytes bytes, std::span<const BlockShape> blocks, uint64_t corners,
                      PatchTopology& topology, std::span<const uint32_t> offsets = {});

/// Puts the cells of a mesh into coded order and codes them by the front. Error: unsupported, for 2^29
/// corners or more.
Result<EncodedTopology> encode_topology(const Mesh& mesh);

/// Fills sources.corners: by half-edge, then by corner of loose cells. Needs half-edges.
void find_corner_sources(const Mesh& mesh, EncodedTopology& encoded);

/// Inverse of encode_topology. Safe on any bytes: the result fits `blocks` and `points`, or corrupt.
/// `with_faces`: the list of faces is needed, for arrays on cells or corners.
Result<PatchTopology> decode_topology(Bytes bytes, std::span<const BlockShape> blocks, uint32_t points,
                                      uint64_t corners, bool with_faces);

/// Cells of the decoded mesh, block by block: faces of the surface in coded order, then loose cells.
/// `cell_place` and `corner_place` give the place of each element (PatchElements) in the mesh; none for gaps.
/// Takes the topology apart.
struct AssembledCells {
  std::vector<CellBlock> blocks;  ///< without names
  std::vector<uint32_t> cell_place;
  std::vector<uint32_t> corner_place;
};
AssembledCells assemble_cells(PatchTopology topology, std::span<const BlockShape> blocks, bool with_places);

}  // namespace maille
