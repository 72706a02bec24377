#pragma once

#include <maille/mesh.h>
#include <maille/parts.h>

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"

namespace maille {

/// What parts of a mesh say of the whole, by their arrays: vtkGhostType (or vtkGhostLevels) on points and
/// cells, and numbers of the whole mesh, whose arrays have different names in different formats.
struct PartMarks {
  std::string point_ids = "GlobalPointIds", cell_ids = "GlobalCellIds";  ///< names of arrays
};

/// Makes one mesh of parts whose points and cells stand one after the other. `first_points`: the first point
/// of each part; `first_cells`, too. Ghost cells are left out. Points are one where they have one number of
/// the whole mesh; without numbers, where ghosts tell that the parts overlap, those of different parts at one
/// place; else none. Numbers of the whole mesh give the order. What was done is told in the notes.
///
/// `apart`: not all parts are there; null: they are, and so the owners of all ghosts. Errors:
/// malformed_input, for a ghost cell that no part owns, and for numbers that contradict each other.
Result<> join_parts(const std::string& name, const std::vector<uint64_t>& first_points,
                    const std::vector<uint64_t>& first_cells, const PartMarks& marks, CellKeys* apart,
                    Mesh& mesh, std::vector<std::string>& notes);

}  // namespace maille
