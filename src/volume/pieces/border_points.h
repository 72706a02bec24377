#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace maille {

/// Points on faces that one cell has alone (of any odd number), and those of cells whose faces are not known:
/// where a piece may have points in common with others. `number`: by point of the mesh its number in the
/// coded order; none: as they are. Rising, coded numbers. Sums of coded numbers stand for faces, and a wrong
/// point by chance (2^-64 for each) is the same one in encoder and decoder, whatever the order of cells.
std::vector<uint32_t> border_points(const Mesh& piece, std::span<const uint32_t> number = {});

/// By each of the points 1 if it lies on a side of the box around all positions, else 0.
std::vector<uint8_t> on_sides(const Array& positions, std::span<const uint32_t> points);

}  // namespace maille
