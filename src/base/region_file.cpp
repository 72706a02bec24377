#include "base/region_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>

#include "base/result.h"

namespace maille {

RegionFile::~RegionFile() {
  if (file_.valid() && !committed_) ::unlinkat(folder_.get(), temporary_.c_str(), 0);
}

Result<> RegionFile::open() {
  place_ = split_path(path_);
  folder_ = Descriptor(::open(place_.folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder_.valid()) return cannot_write(path_ + ": folder " + place_.folder);
  temporary_ = temporary_name(place_.name);
  registration_.emplace(folder_.get(), temporary_);
  file_ =
      Descriptor(::openat(folder_.get(), temporary_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666));
  return file_.valid() ? Result<>() : cannot_write(path_);
}

Result<> RegionFile::write_at(uint64_t offset, Bytes bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return cannot_write(path_);
    offset += static_cast<uint64_t>(written);
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
  return {};
}

Result<> RegionFile::commit() {
  if (::fsync(file_.get()) != 0) return cannot_write(path_);
  if (::renameat(folder_.get(), temporary_.c_str(), folder_.get(), place_.name.c_str()) != 0)
    return cannot_write(path_);
  committed_ = true;
  ::fsync(folder_.get());  // best effort: some file systems cannot sync a folder
  return {};
}

}  // namespace maille
