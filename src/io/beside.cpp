#include "io/beside.h"

#include <filesystem>

#include "base/opened_file.h"
#include "io/reading.h"

namespace maille {
namespace {

struct BesideFile {
  Descriptor file;
  std::string path;
};

Result<BesideFile> open_named(const std::string& file, const std::string& named) {
  std::string path = MAILLE_TRY(path_of_named(file, named));
  const std::string folder = std::filesystem::path(file).parent_path().string();
  return BesideFile{MAILLE_TRY(open_beneath(folder.empty() ? "." : folder, named)), std::move(path)};
}

}  // namespace

Result<std::unique_ptr<Source>> open_beside(const std::string& file, const std::string& named) {
  BesideFile beside = MAILLE_TRY(open_named(file, named));
  return plain_source(std::move(beside.file), beside.path);
}

Result<std::string> path_beside(const std::string& file, const std::string& named) {
  const std::string path = MAILLE_TRY(path_of_named(file, named));
  std::error_code error;
  const bool there = std::filesystem::exists(std::filesystem::symlink_status(path, error));
  return there ? MAILLE_TRY(open_named(file, named)).path : path;
}

}  // namespace maille
