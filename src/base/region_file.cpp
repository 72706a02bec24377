#include "base/region_file.h"

#include <unistd.h>

#include "base/result.h"

namespace maille {

Result<> RegionFile::open() {
  file_ = MAILLE_TRY(PendingFile::create(path_));
  return {};
}

Result<> RegionFile::write_at(uint64_t offset, Bytes bytes) {
  while (!bytes.empty()) {
    const ssize_t written =
        ::pwrite(file_->descriptor(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return cannot_write(path_);
    offset += static_cast<uint64_t>(written);
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
  return {};
}

}  // namespace maille
