#pragma once

#include <maille/io.h>

#include <span>
#include <string>
#include <vector>

namespace maille {

/// Files that together are one mesh, of one that names them (.pvtu); none for other files. Errors:
/// cannot_read, malformed_input.
[[nodiscard]] Result<std::vector<std::string>> parts_of_mesh(const std::string& path);
/// Cells of parts by keys, which follow from GlobalPointIds: a cell has the same in all parts. Without these
/// numbers there are none.
struct CellKeys {
  std::vector<uint64_t> own, ghosts;
};
/// Reads VTU files that are parts of one mesh. Ghost cells (vtkGhostType) are left out; points are one where
/// they have one number in GlobalPointIds, or without it, where there are ghosts, one place. A ghost that no
/// part owns is an error. `apart`: these are not all parts, so whoever has the others looks for the owners.
[[nodiscard]] Result<ReadResult> read_parts(std::span<const std::string> paths,
                                            const ReadOptions& options = {}, CellKeys* apart = nullptr);

}  // namespace maille
