#pragma once

#include <maille/error.h>
#include <maille/source.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

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

}  // namespace maille
