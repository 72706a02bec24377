#include "serve/viewer_files.h"

#include <climits>
#include <cstdlib>
#include <string>

namespace maille::tool {

namespace {

/// The folder of the program that runs; empty where the system does not tell.
std::string program_folder() {
#ifdef __linux__
  char* const found = ::realpath("/proc/self/exe", nullptr);
  if (found == nullptr) return {};
  const std::string path = found;
  std::free(found);
  return path.substr(0, path.rfind('/'));
#else
  return {};
#endif
}

}  // namespace

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
