#include "support/data.h"

#include <algorithm>
#include <filesystem>

namespace maille::testing {

std::string tests_folder() {
  return MAILLE_TESTS_DIR;
}

std::string data_folder() {
  return std::filesystem::exists(MAILLE_DATA_DIR "/tri") ? MAILLE_DATA_DIR : "";
}

std::vector<std::string> data_files(const std::string& folder) {
  std::vector<std::string> files;
  const std::string path = data_folder() + "/" + folder;
  // Without the shared meshes there are those of packages (scripts/data), perhaps not in all folders.
  if (data_folder().empty() || !std::filesystem::exists(path)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(path)) files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace maille::testing
