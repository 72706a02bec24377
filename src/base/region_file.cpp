#include "base/region_file.h"

#include "base/result.h"

namespace maille {

Result<> RegionFile::open() {
  file_ = MAILLE_TRY(PendingFile::create(path_));
  return {};
}

Result<> RegionFile::write_at(uint64_t offset, Bytes bytes) {
  if (!write_to(file_->descriptor(), offset, bytes)) return cannot_write(path_);
  return {};
}

}  // namespace maille
