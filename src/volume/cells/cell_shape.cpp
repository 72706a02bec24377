#include "volume/cells/cell_shape.h"

#include <initializer_list>

namespace maille {
namespace {

using Faces = std::initializer_list<std::initializer_list<uint8_t>>;

// Faces as in VTK's vtkHexahedron.h and its siblings: seen from outside, counter-clockwise. Opposite faces of
// the hexahedron stand side by side, which the prediction of cell arrays relies on.
constexpr Faces no_faces = {};
constexpr Faces line_faces = {{0}, {1}};
constexpr Faces triangle_faces = {{0, 1}, {1, 2}, {2, 0}};
constexpr Faces quad_faces = {{0, 1}, {1, 2}, {2, 3}, {3, 0}};
constexpr Faces tetrahedron_faces = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 2, 1}};
constexpr Faces hexahedron_faces = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                                    {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}};
constexpr Faces wedge_faces = {{0, 1, 2}, {3, 5, 4}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}};
constexpr Faces pyramid_faces = {{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};

/// The face other than `own` that has both corners; `own` where there is no other, as for polygons and lines,
/// whose edges have no face across.
constexpr uint8_t face_across(const CellShape& shape, unsigned own, unsigned a, unsigned b) {
  const unsigned both = shape.faces_at[a] & shape.faces_at[b] & ~(1u << own);
  return static_cast<uint8_t>(both == 0 ? own : static_cast<unsigned>(__builtin_ctz(both)));
}

constexpr void join(CellShape& shape, unsigned a, unsigned b) {
  shape.neighbours[a] = static_cast<uint8_t>(shape.neighbours[a] | 1u << b);
  shape.neighbours[b] = static_cast<uint8_t>(shape.neighbours[b] | 1u << a);
}

constexpr void join_around(CellShape& shape, const CellFace& face) {
  for (unsigned i = 0; i < face.size; ++i) {
    if (face.size > 1) join(shape, face.corner[i], face.corner[(i + 1u) % face.size]);
  }
}

constexpr void add_parallelograms(CellShape& shape, const uint8_t (&cycle)[4]) {
  for (unsigned i = 0; i < 4; ++i) {
    const unsigned corner = cycle[i];
    shape.parallelogram[corner][shape.parallelograms[corner]++] = {cycle[(i + 1) % 4], cycle[(i + 3) % 4],
                                                                   cycle[(i + 2) % 4]};
  }
}

/// Which edge of the face across lies on this one; faces across must be there. The loop ends, as
/// face_across() found a face that has both corners, and cycles seen from outside run in opposite directions.
constexpr uint8_t edge_across(const CellShape& shape, const CellFace& face, unsigned edge) {
  const CellFace& other = shape.face[face.across[edge]];
  uint8_t at = 0;  // seen from outside, faces run through their edge in opposite directions
  while (other.corner[(at + 1u) % other.size] != face.corner[edge]) ++at;
  return at;
}

constexpr CellShape outline(CellType type, unsigned dimension, unsigned corners, Faces faces) {
  CellShape shape;
  shape.type = type;
  shape.dimension = static_cast<uint8_t>(dimension);
  shape.corners = shape.nodes = static_cast<uint8_t>(corners);
  for (const auto& corners_of_face : faces) {
    CellFace& face = shape.face[shape.faces];
    for (const uint8_t corner : corners_of_face) {
      face.corner[face.size++] = corner;
      shape.faces_at[corner] = static_cast<uint8_t>(shape.faces_at[corner] | 1u << shape.faces);
      shape.corners_of[shape.faces] = static_cast<uint8_t>(shape.corners_of[shape.faces] | 1u << corner);
    }
    for (unsigned i = 0; i < face.size; ++i) {
      shape.beside[shape.faces][face.corner[i]] = {face.corner[(i + face.size - 1u) % face.size],
                                                   face.corner[(i + 1u) % face.size]};
    }
    join_around(shape, face);
    if (face.size == 4)
      add_parallelograms(shape, {face.corner[0], face.corner[1], face.corner[2], face.corner[3]});
    ++shape.faces;
  }
  if (dimension == 2 && corners == 4) add_parallelograms(shape, {0, 1, 2, 3});
  if (dimension == 1) join(shape, 0, 1);
  for (unsigned f = 0; f < shape.faces && dimension == 3; ++f) {
    CellFace& face = shape.face[f];
    for (unsigned i = 0; i < face.size; ++i) {
      face.across[i] = face_across(shape, f, face.corner[i], face.corner[(i + 1u) % face.size]);
    }
  }
  for (unsigned f = 0; f < shape.faces && dimension == 3; ++f) {
    CellFace& face = shape.face[f];
    for (unsigned i = 0; i < face.size; ++i) face.edge_across[i] = edge_across(shape, face, i);
  }
  for (unsigned i = 0; i < most_nodes; ++i) shape.place[i] = static_cast<uint8_t>(i);
  return shape;
}

/// Voxels and pixels count their corners x first, y second: the last two of each quad change places.
constexpr CellShape by_axes(CellShape shape, CellType type) {
  shape.type = type;
  for (unsigned i = 2; i < shape.corners; i += 4) {
    shape.place[i] = static_cast<uint8_t>(i + 1);
    shape.place[i + 1] = static_cast<uint8_t>(i);
  }
  return shape;
}

/// With nodes behind the corners; `nodes` lists the corners each of them lies between, none for all of them.
constexpr CellShape higher(CellShape shape, CellType type, Faces nodes) {
  shape.type = type;
  for (const auto& corners : nodes) {
    unsigned mask = corners.size() == 0 ? (1u << shape.corners) - 1 : 0;
    for (const uint8_t corner : corners) mask |= 1u << corner;
    shape.lies_on[shape.nodes++] = static_cast<uint8_t>(mask);
  }
  return shape;
}

constexpr Faces hexahedron_edges = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                    {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
constexpr Faces hexahedron_middles = {
    {0, 1},       {1, 2},       {2, 3},       {3, 0},       {4, 5}, {5, 6},       {6, 7},
    {7, 4},       {0, 4},       {1, 5},       {2, 6},       {3, 7}, {0, 4, 7, 3}, {1, 2, 6, 5},
    {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}, {}};
constexpr Faces tetrahedron_edges = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
constexpr Faces wedge_edges = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}};
constexpr Faces pyramid_edges = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 4}, {2, 4}, {3, 4}};

constexpr CellShape line = outline(CellType::line, 1, 2, line_faces);
constexpr CellShape triangle = outline(CellType::triangle, 2, 3, triangle_faces);
constexpr CellShape quad = outline(CellType::quad, 2, 4, quad_faces);
constexpr CellShape tetrahedron = outline(CellType::tetrahedron, 3, 4, tetrahedron_faces);
constexpr CellShape hexahedron = outline(CellType::hexahedron, 3, 8, hexahedron_faces);
constexpr CellShape wedge = outline(CellType::wedge, 3, 6, wedge_faces);
constexpr CellShape pyramid = outline(CellType::pyramid, 3, 5, pyramid_faces);

}  // namespace

// In the order of docs/format.md, 16.2.
constexpr std::array<CellShape, shape_count> cell_shapes = {
    hexahedron,
    tetrahedron,
    wedge,
    pyramid,
    quad,
    triangle,
    line,
    outline(CellType::vertex, 0, 1, no_faces),
    by_axes(hexahedron, CellType::voxel),
    by_axes(quad, CellType::pixel),
    higher(line, CellType::quadratic_edge, {{0, 1}}),
    higher(triangle, CellType::quadratic_triangle, {{0, 1}, {1, 2}, {2, 0}}),
    higher(quad, CellType::quadratic_quad, {{0, 1}, {1, 2}, {2, 3}, {3, 0}}),
    higher(tetrahedron, CellType::quadratic_tetrahedron, tetrahedron_edges),
    higher(hexahedron, CellType::quadratic_hexahedron, hexahedron_edges),
    higher(wedge, CellType::quadratic_wedge, wedge_edges),
    higher(pyramid, CellType::quadratic_pyramid, pyramid_edges),
    higher(hexahedron, CellType::triquadratic_hexahedron, hexahedron_middles),
};

constexpr std::array<uint8_t, shape_count* most_corners> faces_at_corner = [] {
  std::array<uint8_t, shape_count * most_corners> faces{};
  for (unsigned i = 0; i < faces.size(); ++i)
    faces[i] = cell_shapes[i / most_corners].faces_at[i % most_corners];
  return faces;
}();

/// Polyhedra and polygons have no fixed shape and go to FaceCoder.
unsigned kind_of(CellType type) {
  if (type == CellType::polyhedron || type == CellType::polygon) return face_cell;
  for (unsigned kind = 0; kind < shape_count; ++kind) {
    if (cell_shapes[kind].type == type) return kind;
  }
  return loose_cell;
}

}  // namespace maille
