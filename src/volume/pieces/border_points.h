#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace maille {

/// Points on faces that one cell has alone (of any odd number), and those of cells whose faces are not known:
/// where a piece may have points in common with others. `number`: by point of the mesh its number in the
/// coded order; none: as they are. The result is rising, in coded numbers.
/// Sums of coded numbers stand for faces, so that no face is ever looked up: a pass over the cells, 16 bytes
/// a point. A wrong point by chance (2^-64 for each) is the same one in encoder and decoder, whatever the
/// order of cells. A hostile mesh can make such points at will, which costs nobody but its own file.
std::vector<uint32_t> border_points(const Mesh& piece, std::span<const uint32_t> number = {});

/// By each of the points 1 if a decoded coordinate is the least or the largest of all positions (NaN left
/// out), else 0. Points there are mostly on the surface of the mesh, or where planes have cut it, so that
/// both kinds have models of their own (docs/format.md, 15.1).
std::vector<uint8_t> on_sides(const Array& positions, std::span<const uint32_t> points);

}  // namespace maille
