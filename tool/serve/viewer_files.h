#pragma once

#include <optional>

#include "serve/served_files.h"

namespace maille::tool {

/// Where a server has the viewer. No name that begins with a dot is served, so nothing else is there.
inline constexpr const char* viewer_path = "/.viewer";
inline constexpr const char* viewer_is_missing =
    "the viewer was not built with this maille: run scripts/build-viewer (it needs emscripten and npm), or "
    "say "
    "in MAILLE_VIEWER where it is";

/// The viewer's files: the folder that MAILLE_VIEWER names, else share/maille/viewer beside the program's
/// folder, else that of the sources that it was built from. Nothing where there is none.
std::optional<ServedFiles> viewer_files();

}  // namespace maille::tool
