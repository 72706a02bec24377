#include "serve/viewer_files.h"

#include <cstdlib>
#include <string>

#include "program_folder.h"

namespace maille::tool {

std::optional<ServedFiles> viewer_files() {
  std::vector<std::string> folders;
  const std::string program = program_folder();
  if (const char* const named = std::getenv("MAILLE_VIEWER")) {
    folders.emplace_back(named);
  } else if (!program.empty()) {
    // The program is installed in libexec/maille, or stands in build/PRESET/tool.
    folders = {program + "/../../share/maille/viewer", program + "/../../../web/dist/viewer"};
  }
  for (const std::string& folder : folders) {
    auto files = ServedFiles::open(folder);
    if (files && files->only().empty() && files->file("/index.html")) return std::move(*files);
  }
  return std::nullopt;
}

}  // namespace maille::tool
