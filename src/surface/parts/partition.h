#pragma once

#include <maille/executor.h>
#include <maille/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace maille {

/// Cuts a mesh of more than `most_cells` cells along planes until no part has more: each cut halves the cells
/// along the longest side of their box. `positions` are three for each point, as the decoder will have them;
/// then the parts depend only on the set of cells, so that a decoded mesh is cut the same way again. Cells in
/// one place are never separated. Gives the part of each cell; the number of parts is one more than the
/// highest.
std::vector<uint32_t> partition_cells(const Mesh& mesh, std::span<const float> positions, uint64_t most_cells,
                                      Executor& executor = serial_executor());

}  // namespace maille
