#pragma once

#include <maille/executor.h>
#include <maille/mesh.h>

#include <cstdint>
#include <vector>

namespace maille {

/// Cuts the cells of a mesh into pieces of space of about `target` cells each, at least one: recursive
/// bisection of the cells' middles, across the axis and at the place near the middle where the fewest cells
/// are on the way (cut_rules.h). It needs no graph, and runs between layers of a lattice, not through one.
///
/// By piece the numbers of its cells through all blocks, rising; neighbours in the list are mostly neighbours
/// in space. The same on every machine, for any executor. The mesh has fewer than 2^32 cells.
std::vector<std::vector<uint32_t>> cut_cells(const Mesh& mesh, uint64_t target, Executor& executor);

/// The same for groups that have no borders to pay for: always across the longest side, which takes a third
/// of the time.
std::vector<std::vector<uint32_t>> group_cells(const Mesh& mesh, uint64_t target);

}  // namespace maille
