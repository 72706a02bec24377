#include "paths.h"

#include <maille/io.h>
#include <algorithm>
#include <filesystem>

namespace maille::bench {

namespace fs = std::filesystem;

std::vector<std::string> meshes_in(const std::vector<std::string>& paths) {
  std::vector<std::string> found;
  for (const std::string& path : paths) {
    if (!fs::is_directory(path)) {
      found.push_back(path);
      continue;
    }
    const auto first = static_cast<std::ptrdiff_t>(found.size());
    for (const auto& entry : fs::recursive_directory_iterator(path)) {
      if (entry.is_regular_file() && format_of(entry.path().string())) found.push_back(entry.path().string());
    }
    std::sort(found.begin() + first, found.end());
  }
  return found;
}

std::string folder_of(const std::string& path) {
  return fs::absolute(path).parent_path().filename().string();
}

std::string mesh_name(const std::string& path) {
  const std::string name = fs::path(path).filename().string();
  return name.substr(0, name.find('.'));
}

}  // namespace maille::bench
