#pragma once

#include <maille/mesh.h>

#include <vector>

namespace maille {

/// The cells that `keep` says, through all blocks, with the points they use, arrays following.
Mesh keep_cells(const Mesh& mesh, const std::vector<bool>& keep);

}  // namespace maille
