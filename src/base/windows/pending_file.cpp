#include "base/pending_file.h"

#include <fcntl.h>

#include "base/result.h"
#include "base/windows/calls.h"

namespace maille {
namespace {

/// Is the file to be gone when it is closed, however the process ends?
bool remove_at_close(int fd, bool remove) {
  FILE_DISPOSITION_INFO info{};
  info.DeleteFile = remove;
  return SetFileInformationByHandle(handle_of(fd), FileDispositionInfo, &info, sizeof info) || failed();
}

}  // namespace

PendingFile::PendingFile(const std::string& path) : path_(path), place_(split_path(path)) {}

PendingFile::~PendingFile() = default;

// A temporary name, and permissions that are those of the folder: Windows has neither files without names nor
// a mode of a file.
Result<std::unique_ptr<PendingFile>> PendingFile::create(const std::string& path, std::optional<unsigned>,
                                                         Naming) {
  std::unique_ptr<PendingFile> file(new PendingFile(path));
  file->temporary_ = file->place_.folder + "/" + temporary_name(file->place_.name);
  file->file_ = Descriptor(
      create_file(file->temporary_, GENERIC_WRITE | DELETE, CREATE_NEW, FILE_ATTRIBUTE_NORMAL, _O_WRONLY));
  if (!file->file_.valid() || !remove_at_close(file->descriptor(), true))
    return cannot_write(path + ": folder " + file->place_.folder);
  return file;
}

// Between close and rename the file has its temporary name, and would keep it if the machine stopped there.
Result<> PendingFile::commit() {
  if (committed_) return {};
  if (!sync(descriptor()) || !remove_at_close(descriptor(), false) || !file_.close())
    return cannot_write(path_);
  const std::wstring from = wide(temporary_);
  if (!MoveFileExW(from.c_str(), wide(path_).c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH)) {
    failed();
    DeleteFileW(from.c_str());
    return cannot_write(path_);
  }
  committed_ = true;
  return {};
}

}  // namespace maille
