#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>
#include <vector>

#include "volume/cells/cell_shape.h"

namespace maille {

inline constexpr uint32_t no_cell = 0xffffffff;

/// By cell and face: the cell across. Cells with the same face go in pairs, in order, so that of three the
/// third has none across; nor has a cell that has the face twice. Faces are the same if they have the same
/// points in any order.
using Neighbours = std::vector<std::array<uint32_t, most_faces>>;
/// `on_border`, if given, has an entry for each point: points of faces that are not in a pair are set to 1.
Neighbours neighbours_of(const CellBlock& block, std::vector<uint8_t>* on_border = nullptr);

/// The cells of a block in an order that is cheap to code and keeps the front small: always the cell that
/// most faces of the front wait for, among equals the one that the front reached first (of tetrahedra and
/// triangles: last). A cell may come at any time, so that meshes in no order (most unstructured generators)
/// become streams with a narrow front. Memory: about 100 bytes a cell. Blocks of 2^32 - 1 cells or more stay
/// as they are.
std::vector<uint64_t> front_order(const CellBlock& block);

}  // namespace maille
