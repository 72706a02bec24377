#include <maille/faces.h>

namespace maille {
namespace {

// VTK's numbering of faces and corners. The corners of each face run counterclockwise as seen from outside of
// a cell that is not turned inside out.
constexpr FacesOfSolid no_faces;
constexpr FacesOfSolid tetrahedron = {4, {{{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 2, 1}}}, {3, 3, 3, 3}};
constexpr FacesOfSolid pyramid = {
    5, {{{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}}, {4, 3, 3, 3, 3}};
constexpr FacesOfSolid wedge = {
    5, {{{0, 1, 2}, {3, 5, 4}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}}}, {3, 3, 4, 4, 4}};
constexpr FacesOfSolid hexahedron = {
    6,
    {{{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}}},
    {4, 4, 4, 4, 4, 4}};
// Corners of a voxel are numbered by the bits of their place (x + 2 y + 4 z), not around its faces as those
// of a hexahedron.
constexpr FacesOfSolid voxel = {
    6,
    {{{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}},
    {4, 4, 4, 4, 4, 4}};
constexpr FacesOfSolid pentagonal_prism = {7,
                                           {{{0, 4, 3, 2, 1},
                                             {5, 6, 7, 8, 9},
                                             {0, 1, 6, 5},
                                             {1, 2, 7, 6},
                                             {2, 3, 8, 7},
                                             {3, 4, 9, 8},
                                             {4, 0, 5, 9}}},
                                           {5, 5, 4, 4, 4, 4, 4}};
constexpr FacesOfSolid hexagonal_prism = {8,
                                          {{{0, 5, 4, 3, 2, 1},
                                            {6, 7, 8, 9, 10, 11},
                                            {0, 1, 7, 6},
                                            {1, 2, 8, 7},
                                            {2, 3, 9, 8},
                                            {3, 4, 10, 9},
                                            {4, 5, 11, 10},
                                            {5, 0, 6, 11}}},
                                          {6, 6, 4, 4, 4, 4, 4, 4}};

}  // namespace

// In VTK the corners of a curved cell come first, in the order of the straight one; so both have the same
// faces, and nodes on edges, faces and inside are left out.
const FacesOfSolid& faces_of(CellType type) {
  switch (type) {
    case CellType::tetrahedron:
    case CellType::quadratic_tetrahedron:
    case CellType::lagrange_tetrahedron:
      return tetrahedron;
    case CellType::pyramid:
    case CellType::quadratic_pyramid:
    case CellType::triquadratic_pyramid:
    case CellType::lagrange_pyramid:
      return pyramid;
    case CellType::wedge:
    case CellType::quadratic_wedge:
    case CellType::quadratic_linear_wedge:
    case CellType::biquadratic_quadratic_wedge:
    case CellType::lagrange_wedge:
      return wedge;
    case CellType::hexahedron:
    case CellType::quadratic_hexahedron:
    case CellType::triquadratic_hexahedron:
    case CellType::biquadratic_quadratic_hexahedron:
    case CellType::lagrange_hexahedron:
      return hexahedron;
    case CellType::voxel:
      return voxel;
    case CellType::pentagonal_prism:
      return pentagonal_prism;
    case CellType::hexagonal_prism:
      return hexagonal_prism;
    default:
      return no_faces;
  }
}

}  // namespace maille
