#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>
#include <vector>

#include "volume/cell_shape.h"

namespace maille {

inline constexpr uint32_t no_cell = 0xffffffff;

/// Neighbours across faces, by cell: at most six. Where three cells have a face, those beside each other in
/// number.
std::vector<std::array<uint32_t, most_faces>> neighbours_of(const CellBlock& block);

/// By point: is it on a face that only one cell of its block has?
std::vector<bool> points_on_border(const std::vector<CellBlock>& blocks, uint64_t points);

/// The cells of a block in an order that is cheap to code and keeps the front small: always the cell that
/// most faces of the front wait for, among equals the one that the front reached first. A cell may come at
/// any time, so that meshes in no order (most unstructured generators) become streams with a narrow front.
/// Memory: about 100 bytes a cell.
std::vector<uint64_t> front_order(const CellBlock& block);

}  // namespace maille
