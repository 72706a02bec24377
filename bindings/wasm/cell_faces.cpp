#include "cell_faces.h"

namespace maille::wasm {

unsigned corners_of(CellType type, size_t nodes) {
  switch (type) {
    case CellType::quadratic_triangle:
    case CellType::biquadratic_triangle:
    case CellType::lagrange_triangle:
      return 3;
    case CellType::pixel:
    case CellType::quadratic_quad:
    case CellType::biquadratic_quad:
    case CellType::quadratic_linear_quad:
    case CellType::lagrange_quad:
      return 4;
    case CellType::quadratic_polygon:
      return static_cast<unsigned>(nodes / 2);
    default:
      return static_cast<unsigned>(nodes);
  }
}

}  // namespace maille::wasm
