#pragma once

#include <maille/folder.h>

#include <vector>

namespace maille {

/// A folder that appears whole or not at all. Folders above it are made, and removed again without commit().
/// Of an older folder at this place the files called in `replaced` are removed, all others are kept. `name`:
/// how messages call the sink. Error: write_failed.
Result<std::unique_ptr<FolderSink>> folder_sink(const std::string& path, std::vector<std::string> replaced,
                                                const std::string& name);

}  // namespace maille
