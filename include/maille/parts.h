#pragma once

#include <maille/io.h>

#include <span>
#include <string>
#include <vector>

namespace maille {

/// Files that together are one mesh, of one that names them (.pvtu); none for other files. Errors:
/// cannot_read, malformed_input.
[[nodiscard]] Result<std::vector<std::string>> parts_of_mesh(const std::string& path);
/// Reads VTU files that are parts of one mesh. Ghost cells (vtkGhostType) are left out; points are one where
/// they have one number in GlobalPointIds, or without it, where there are ghosts, one place. `whole`: these
/// are all parts, so a ghost that none of them owns is an error.
[[nodiscard]] Result<ReadResult> read_parts(std::span<const std::string> paths,
                                            const ReadOptions& options = {}, bool whole = true);

}  // namespace maille
