#pragma once

#include <maille/source.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <span>
#include <string>
#include <utility>

/// What the library asks of the operating system. base/posix and base/windows each have all of it, and the
/// build takes one of them. Paths are UTF-8 everywhere. Calls that fail leave the reason in errno; those that
/// a signal interrupts are made again.
namespace maille {

/// "cannot read PATH: No such file or directory", with the reason in errno.
inline tl::unexpected<Error> cannot_read(const std::string& what) {
  return failure(ErrorCode::cannot_read, "cannot read " + what + ": " + std::strerror(errno));
}
inline tl::unexpected<Error> cannot_write(const std::string& what) {
  return failure(ErrorCode::write_failed, "cannot write " + what + ": " + std::strerror(errno));
}

/// A file descriptor that closes itself. Assignment swaps, so the old descriptor is closed with the other
/// object.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }
  bool valid() const { return fd_ >= 0; }
  /// For files just written: some file systems report a failed write only here. After EINTR the descriptor is
  /// closed all the same on Linux; calling close() again might close another thread's file.
  bool close() { return ::close(std::exchange(fd_, -1)) == 0 || errno == EINTR; }

 private:
  int fd_;
};

Descriptor open_to_read(const std::string& path);
/// Opens what is there already, and leaves its contents alone.
Descriptor open_to_write(const std::string& path);
/// A regular file, or whatever has that name, in `folder` or below; pipes and devices are not waited for.
/// EXDEV: a link leads out of the folder.
Descriptor open_within(const std::string& folder, const std::string& name);
/// A new file to read and write that nobody else finds, and that is gone when it is closed.
Descriptor open_nameless(const std::string& folder);
/// Where such files go unless the user says otherwise.
std::string temporary_folder();

struct FileStatus {
  enum class Kind : uint8_t { none, regular, folder, other } kind = Kind::none;
  unsigned permissions = 0;
  uint64_t size = 0;
};
FileStatus status_of(const std::string& path);
FileStatus status_of(int fd);
bool is_writable(const std::string& path);

/// How many bytes came; 0 at the end, -1 for a failure.
ptrdiff_t read_some(int fd, std::span<std::byte> out);
/// The same from `offset` on, and fewer than asked for only at the end. Several threads may read at once.
ptrdiff_t read_from(int fd, uint64_t offset, std::span<std::byte> out);
bool write_all(int fd, Bytes bytes);
bool write_to(int fd, uint64_t offset, Bytes bytes);
/// Makes what was written durable.
bool sync(int fd);
/// Cuts the file off, or fills it with zeros up to there; what is written next comes behind.
bool cut_to(int fd, uint64_t size);
/// False if somebody else has the file locked so. The system releases the lock when the file is closed, even
/// if the process crashes.
bool lock(int fd);

struct PathParts {
  std::string folder;
  std::string name;
};
PathParts split_path(const std::string& path);

/// Bytes of memory that this process may have; 0 if the system does not say.
uint64_t memory_of_machine();

}  // namespace maille
