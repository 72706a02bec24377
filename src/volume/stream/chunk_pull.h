#pragma once

#include <maille/stream.h>

#include <optional>
#include <vector>

#include "container/layout.h"

namespace maille {

/// Chunks of a file front to back, each verified before it is given out. At the end the digest of the footer
/// is compared, so that nothing was lost on the way. It works on pipes: it never seeks, and holds one chunk
/// (up to 1 MiB), or what came since the mark.
class ChunkPull {
 public:
  explicit ChunkPull(std::unique_ptr<ByteStream> bytes) : bytes_(std::move(bytes)) {}

  /// Reads the file's header; first. Error: corrupt, unsupported, cannot_read.
  Result<FileHeader> begin();
  /// The next chunk, in `header` and `content` (valid until the next call). False: the file has ended, and
  /// whole. An ancillary chunk that is damaged has no content. Error: corrupt (cut off, damaged),
  /// cannot_read.
  Result<bool> next(ChunkHeader& header, Bytes& content);
  /// From here on chunks can be had again.
  void mark();
  /// Goes back to the mark, for bytes that have not arrived yet: the stream gave an error of kind `network`,
  /// and may be asked once more. What was read since is still in the buffer.
  void rewind();
  std::string name() const { return bytes_->name(); }

 private:
  /// Makes `size` bytes from the current place addressable, fewer at the end of the file.
  Result<Bytes> window(size_t size);
  Result<> check_end();

  struct Place {
    size_t begin = 0;  ///< in the buffer: of what was not used
    uint64_t offset = 0;
    uint64_t index_offset = 0;
    std::optional<Digest> digest;
  };

  std::unique_ptr<ByteStream> bytes_;
  std::vector<std::byte> buffer_;
  size_t end_ = 0;  ///< of what was read
  Place at_, mark_;
};

}  // namespace maille
