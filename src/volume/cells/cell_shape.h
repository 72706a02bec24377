#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>

namespace maille {

inline constexpr unsigned most_corners = 8;
inline constexpr unsigned most_faces = 6;
/// Nodes of the largest cell of fixed size, the triquadratic hexahedron.
inline constexpr unsigned most_nodes = 27;

/// A face of a cell is where it meets another cell of its dimension: a polygon of a solid, an edge of a
/// polygon, an end of a line. Faces of cells of different dimensions have different numbers of corners (3 or
/// 4, 2, 1), and so never match.
struct CellFace {
  uint8_t size = 0;
  std::array<uint8_t, 4> corner{};  ///< in a cycle
  /// across[i]: the other face at the edge from corner i to corner i + 1. Solids only.
  std::array<uint8_t, 4> across{};
  std::array<uint8_t, 4> edge_across{};  ///< and which edge of that face it is
};

/// What a cell of one type looks like. Corners are numbered as VTK numbers those of the type with this
/// outline, so a voxel has the corners of a hexahedron. The tables are made by the compiler and never change;
/// bits by corner and by face let hot loops go over sets with a count of trailing zeros.
struct CellShape {
  CellType type = CellType::vertex;
  uint8_t dimension = 0;
  uint8_t corners = 0;
  uint8_t faces = 0;
  uint8_t nodes =
      0;  ///< corners and what comes behind them: nodes in the middle of edges, faces, and the cell
  std::array<CellFace, most_faces> face{};
  std::array<uint8_t, most_faces> corners_of{};  ///< by face, a bit for each corner
  /// By face and corner of it: the corners before and after in the cycle.
  struct Beside {
    uint8_t before = 0, after = 0;
  };
  std::array<std::array<Beside, most_corners>, most_faces> beside{};
  std::array<uint8_t, most_corners> faces_at{};  ///< by corner, a bit for each face
  std::array<uint8_t, most_corners>
      neighbours{};  ///< by corner, a bit for each corner joined to it by an edge
  /// By corner: three corners {a, b, d} of a quad face with it, d opposite, so that a + b - d is expected
  /// there.
  struct Parallelogram {
    uint8_t a = 0, b = 0, opposite = 0;
  };
  std::array<std::array<Parallelogram, 3>, most_corners> parallelogram{};
  std::array<uint8_t, most_corners> parallelograms{};
  /// place[i]: where node i stands in a tuple of the type, as files and Mesh have it.
  std::array<uint8_t, most_nodes> place{};
  /// place[i] is i: but for voxels and pixels, which begin to differ at node 2.
  bool in_place() const { return place[2] == 2; }
  /// For nodes from `corners` on: a bit for each corner of the edge, face or cell they lie on.
  std::array<uint8_t, most_nodes> lies_on{};
};

/// Shapes that the hull codec knows, by an index of their own ("kind"). The numbers stand in files
/// (docs/format.md, 16.2): new kinds are added behind these only with a new version.
inline constexpr unsigned shape_count = 18;
extern const std::array<CellShape, shape_count> cell_shapes;
/// CellShape::faces_at of all, by kind * most_corners + corner: for the loop that takes points out of memory.
extern const std::array<uint8_t, shape_count * most_corners> faces_at_corner;

inline constexpr unsigned hexahedron_kind = 0;
/// Kinds that are no cells of a known shape: a point no cell uses; a cell that is a list of points of any
/// length; word that a point is not used again, where no cell could say so.
inline constexpr unsigned isolated_point = shape_count;
inline constexpr unsigned loose_cell = shape_count + 1;
inline constexpr unsigned ended_point = shape_count + 2;
/// A polyhedron, or a polygon of any size (FaceCoder).
inline constexpr unsigned face_cell = shape_count + 3;
inline constexpr unsigned kind_count = shape_count + 4;
// What one loose cell may claim: 2^24 points are 64 MiB of slots, which grow only as they are decoded.
inline constexpr uint32_t most_loose_nodes = uint32_t{1} << 24;

/// How many bits of a byte are set: of corners or faces. (Processors of 2003 count no bits.)
inline constexpr auto byte_weights = [] {
  std::array<uint8_t, 256> weights{};
  for (unsigned i = 1; i < 256; ++i) weights[i] = static_cast<uint8_t>(weights[i / 2] + i % 2);
  return weights;
}();
inline unsigned bits_in(unsigned byte) {
  return byte_weights[byte];
}

/// The kind of a type; loose_cell for those without a shape. A search of 18 entries, once for each run of
/// cells, not for each cell.
unsigned kind_of(CellType type);

}  // namespace maille
