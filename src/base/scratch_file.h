#pragma once

#include <maille/source.h>

#include <span>
#include <string>
#include <vector>

#include "base/system.h"

namespace maille {

/// A temporary file without a name: it is gone when the process ends, however that ends. For one thread.
/// Reading writes out what was collected first, so reads see all writes. Errors: write_failed, cannot_read.
class ScratchFile {
 public:
  /// `folder`: empty for $TMPDIR, or /tmp. Error: write_failed.
  static Result<ScratchFile> create(const std::string& folder);

  /// Collects small pieces.
  Result<> append(Bytes bytes);
  /// Behind what was appended, or over it.
  Result<> write_at(uint64_t offset, Bytes bytes);
  Result<> read_at(uint64_t offset, std::span<std::byte> out);
  uint64_t size() const { return written_ + buffer_.size(); }

 private:
  ScratchFile(Descriptor file, std::string folder) : file_(std::move(file)), folder_(std::move(folder)) {}
  Result<> flush();

  static constexpr size_t buffer_bytes = size_t{32} << 10;
  Descriptor file_;
  std::string folder_;
  std::vector<std::byte> buffer_;
  uint64_t written_ = 0;
};

}  // namespace maille
