#pragma once

#include "base/result.h"
#include "base/system.h"

namespace maille {

/// Collects small writes; hands large ones through. Remembers its first failure, so that a caller who
/// overlooks it cannot commit half a file.
class DescriptorOutput {
 public:
  DescriptorOutput(int fd, std::string name) : fd_(fd), name_(std::move(name)) {}

  Result<> write(Bytes bytes) {
    if (failed_ == 0 && buffer_.size() + bytes.size() < buffer_bytes) {
      buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
      return {};
    }
    MAILLE_CHECK(flush());
    return write_now(bytes);
  }

  Result<> flush() {
    MAILLE_CHECK(write_now(buffer_));
    buffer_.clear();
    return {};
  }

  const std::string& name() const { return name_; }

 private:
  // Chosen, not swept: large enough that calls of the system are few, small enough to stay in the cache.
  static constexpr size_t buffer_bytes = size_t{64} << 10;

  Result<> write_now(Bytes bytes) {
    if (failed_ == 0 && !write_all(fd_, bytes)) failed_ = errno;
    if (failed_ == 0) return {};
    // Later calls of the system may have set errno; the first failure is the one to report.
    errno = failed_;
    return cannot_write(name_);
  }

  int fd_;
  std::string name_;
  std::vector<std::byte> buffer_;
  int failed_ = 0;
};

}  // namespace maille
