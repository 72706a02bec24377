#pragma once

#include <maille/stream.h>

#include <optional>
#include <vector>

#include "container/layout.h"

namespace maille {

/// Chunks of a file front to back, each verified before it is given out. At the end the digest of the footer
/// is compared, so that nothing was lost on the way.
class ChunkPull {
 public:
  explicit ChunkPull(std::unique_ptr<ByteStream> bytes) : bytes_(std::move(bytes)) {}

  /// Reads the file's header; first. Error: corrupt, unsupported, cannot_read.
  Result<FileHeader> begin();
  /// The next chunk, in `header` and `content` (valid until the next call). False: the file has ended, and
  /// whole. Error: corrupt (cut off, damaged), cannot_read.
  Result<bool> next(ChunkHeader& header, Bytes& content);
  std::string name() const { return bytes_->name(); }

 private:
  /// Makes `size` bytes from the current place addressable, fewer at the end of the file.
  Result<Bytes> window(size_t size);
  Result<> check_end();

  std::unique_ptr<ByteStream> bytes_;
  std::vector<std::byte> buffer_;
  size_t begin_ = 0, end_ = 0;  ///< of what was read and not used
  uint64_t offset_ = 0;
  uint64_t index_offset_ = 0;
  std::optional<Digest> digest_;
};

}  // namespace maille
