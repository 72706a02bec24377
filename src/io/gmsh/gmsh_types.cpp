// The elements of Gmsh as cells of VTK.
#include "io/gmsh/gmsh.h"

#include <algorithm>

namespace maille {
namespace {

// Gmsh and VTK number edges and faces of the quadratic elements in other orders. Each table says which node
// of Gmsh's element is node i of VTK's cell. Types without a table are numbered alike.
constexpr uint8_t tet10[] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 8};
constexpr uint8_t hex20[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15};
constexpr uint8_t hex27[] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  11, 13, 9,  16, 18,
                             19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26};
// The triangle 0 1 2 of a wedge is seen from outside in VTK, from inside in Gmsh, so nodes 1 and 2, and 4 and
// 5, change places.
constexpr uint8_t prism6[] = {0, 2, 1, 3, 5, 4};
constexpr uint8_t prism15[] = {0, 2, 1, 3, 5, 4, 7, 9, 6, 13, 14, 12, 8, 11, 10};
constexpr uint8_t prism18[] = {0, 2, 1, 3, 5, 4, 7, 9, 6, 13, 14, 12, 8, 11, 10, 16, 17, 15};
constexpr uint8_t pyramid13[] = {0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12};
constexpr uint8_t pyramid14[] = {0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12, 13};

// Types of higher order than the second are not known: their number of nodes grows, and VTK's Lagrange cells
// number them by another rule.
constexpr GmshType types[] = {{1, CellType::line, 2, {}},
                              {2, CellType::triangle, 3, {}},
                              {3, CellType::quad, 4, {}},
                              {4, CellType::tetrahedron, 4, {}},
                              {5, CellType::hexahedron, 8, {}},
                              {6, CellType::wedge, 6, prism6},
                              {7, CellType::pyramid, 5, {}},
                              {8, CellType::quadratic_edge, 3, {}},
                              {9, CellType::quadratic_triangle, 6, {}},
                              {10, CellType::biquadratic_quad, 9, {}},
                              {11, CellType::quadratic_tetrahedron, 10, tet10},
                              {12, CellType::triquadratic_hexahedron, 27, hex27},
                              {13, CellType::biquadratic_quadratic_wedge, 18, prism18},
                              {14, CellType::lagrange_pyramid, 14, pyramid14},
                              {15, CellType::vertex, 1, {}},
                              {16, CellType::quadratic_quad, 8, {}},
                              {17, CellType::quadratic_hexahedron, 20, hex20},
                              {18, CellType::quadratic_wedge, 15, prism15},
                              {19, CellType::quadratic_pyramid, 13, pyramid13}};

}  // namespace

std::string gmsh_name(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

const GmshType* gmsh_type(int64_t number) {
  const auto known = std::find_if(std::begin(types), std::end(types),
                                  [&](const GmshType& type) { return type.number == number; });
  return known == std::end(types) ? nullptr : known;
}

// Polygons of three and four corners are what Gmsh calls triangles and quads; larger ones it has no element
// for.
const GmshType* gmsh_type(CellType type, size_t nodes) {
  if (type == CellType::polygon && nodes == 3) type = CellType::triangle;
  if (type == CellType::polygon && nodes == 4) type = CellType::quad;
  for (const GmshType& known : types) {
    if (known.type == type && known.nodes == nodes) return &known;
  }
  return nullptr;
}

}  // namespace maille
