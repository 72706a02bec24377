#include "io/beside.h"

#include <maille/path.h>

#include <algorithm>
#include <filesystem>

#include "base/opened_file.h"

namespace maille {
namespace {

/// The path of `named` as seen from where `file` is, checked by its text alone: neither absolute nor with
/// "..", not an address and not standard input. It touches no file, so links are open_beneath()'s part.
/// Error: malformed_input.
Result<std::string> path_of_named(const std::string& file, const std::string& named) {
  const std::filesystem::path path = to_path(named);
  const bool leads_out = path.is_absolute() || std::find(path.begin(), path.end(), "..") != path.end();
  const bool no_file = named.empty() || named == "-" || named.find("://") != std::string::npos;
  if (leads_out || no_file) {
    return failure(ErrorCode::malformed_input, file + ": it names the file \"" + named +
                                                   "\"; only files in the same folder or below are opened");
  }
  return to_utf8(to_path(file).parent_path() / path);
}

/// An opened file with the path that messages call it by. Readers use the descriptor and never open the path
/// again, so nobody can put a link in its place meanwhile.
struct BesideFile {
  Descriptor file;
  std::string path;
};

Result<BesideFile> open_named(const std::string& file, const std::string& named) {
  std::string path = MAILLE_TRY(path_of_named(file, named));
  const std::string folder = to_utf8(to_path(file).parent_path());
  return BesideFile{MAILLE_TRY(open_beneath(folder.empty() ? "." : folder, named)), std::move(path)};
}

}  // namespace

Result<std::unique_ptr<Source>> open_beside(const std::string& file, const std::string& named) {
  BesideFile beside = MAILLE_TRY(open_named(file, named));
  const uint64_t size = MAILLE_TRY(plain_size(beside.file.get(), beside.path));
  return plain_source(std::move(beside.file), size, beside.path);
}

// Libraries such as HDF5 open by path. Looking at the file first refuses links out of the folder, but
// somebody who may write into the folder can still exchange it between this look and the library's.
Result<std::string> path_beside(const std::string& file, const std::string& named) {
  const std::string path = MAILLE_TRY(path_of_named(file, named));
  std::error_code error;
  const bool there = std::filesystem::exists(std::filesystem::symlink_status(to_path(path), error));
  return there ? MAILLE_TRY(open_named(file, named)).path : path;
}

}  // namespace maille
