#include "base/system.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cstdlib>

#include "base/unfinished.h"

namespace maille {
namespace {

FileStatus told(const struct stat& info) {
  using Kind = FileStatus::Kind;
  const Kind kind = S_ISREG(info.st_mode)   ? Kind::regular
                    : S_ISDIR(info.st_mode) ? Kind::folder
                                            : Kind::other;
  return {kind, info.st_mode & 07777u, static_cast<uint64_t>(info.st_size)};
}

/// A call that a signal interrupted has done nothing; that is no failure.
template <class Call>
auto uninterrupted(Call&& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

}  // namespace

Descriptor open_to_read(const std::string& path) {
  return Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
}

Descriptor open_to_write(const std::string& path) {
  return Descriptor(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
}

// Without a name from the beginning where the file system can do that, else from the next moment on.
Descriptor open_nameless(const std::string& folder) {
#ifdef O_TMPFILE
  // 0600, here and below: temporary folders are open to everybody, and what is in the file may be private.
  Descriptor nameless(::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
  if (nameless.valid()) return nameless;
#endif
  const Descriptor place(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!place.valid()) return Descriptor();
  const std::string name = temporary_name("maille");
  // The name is registered before the file is there, so that a signal in between leaves nothing behind.
  const UnfinishedRegistration registration(place.get(), name);
  Descriptor file(::openat(place.get(), name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (file.valid()) ::unlinkat(place.get(), name.c_str(), 0);
  return file;
}

std::string temporary_folder() {
  const char* const chosen = std::getenv("TMPDIR");
  return chosen != nullptr && *chosen != '\0' ? chosen : "/tmp";
}

FileStatus status_of(const std::string& path) {
  struct stat info {};
  return ::stat(path.c_str(), &info) == 0 ? told(info) : FileStatus();
}

FileStatus status_of(int fd) {
  struct stat info {};
  return ::fstat(fd, &info) == 0 ? told(info) : FileStatus();
}

bool is_writable(const std::string& path) {
  return ::access(path.c_str(), W_OK) == 0;
}

ptrdiff_t read_some(int fd, std::span<std::byte> out) {
  return uninterrupted([&] { return ::read(fd, out.data(), out.size()); });
}

ptrdiff_t read_from(int fd, uint64_t offset, std::span<std::byte> out) {
  size_t done = 0;
  while (done < out.size()) {
    const ssize_t count = uninterrupted(
        [&] { return ::pread(fd, out.data() + done, out.size() - done, static_cast<off_t>(offset + done)); });
    if (count < 0) return -1;
    if (count == 0) break;
    done += static_cast<size_t>(count);
  }
  return static_cast<ptrdiff_t>(done);
}

bool write_all(int fd, Bytes bytes) {
  while (!bytes.empty()) {
    const ssize_t count = uninterrupted([&] { return ::write(fd, bytes.data(), bytes.size()); });
    if (count < 0) return false;
    bytes = bytes.subspan(static_cast<size_t>(count));
  }
  return true;
}

bool write_to(int fd, uint64_t offset, Bytes bytes) {
  while (!bytes.empty()) {
    const ssize_t count =
        uninterrupted([&] { return ::pwrite(fd, bytes.data(), bytes.size(), static_cast<off_t>(offset)); });
    // 0 is an error as well: the bytes left are never none here, so the loop would not end. It sets no errno.
    if (count == 0) errno = ENOSPC;
    if (count <= 0) return false;
    offset += static_cast<uint64_t>(count);
    bytes = bytes.subspan(static_cast<size_t>(count));
  }
  return true;
}

bool sync(int fd) {
  return uninterrupted([&] { return ::fsync(fd); }) == 0;
}

bool cut_to(int fd, uint64_t size) {
  const auto end = static_cast<off_t>(size);
  return ::ftruncate(fd, end) == 0 && ::lseek(fd, end, SEEK_SET) == end;
}

bool lock(int fd) {
  return ::flock(fd, LOCK_EX | LOCK_NB) == 0;
}

PathParts split_path(const std::string& path) {
  const size_t slash = path.rfind('/');
  if (slash == std::string::npos) return {".", path};
  return {slash == 0 ? "/" : path.substr(0, slash), path.substr(slash + 1)};
}

}  // namespace maille
