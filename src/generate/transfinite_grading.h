#pragma once

#include <maille/generate.h>
#include <cstdint>
#include <vector>

namespace maille {

/// Where the points of an edge of `cells` cells are: cells + 1 parameters, the first 0, the last 1. Found to
/// be what OpenFOAM's blockMesh does, for sections whose shares do not come out in whole cells, too.
std::vector<double> edge_parameters(const Grading& grading, uint32_t cells);

/// Cells of each section; empty when there are fewer cells than sections.
std::vector<uint32_t> section_cells(const Grading& grading, uint32_t cells);

}  // namespace maille
