#pragma once

#include "container/file_writer.h"

namespace maille {

/// Opens a file, finds its chunks by the index or, when that is damaged, by scanning; gives streams back whole.
class FileReader {
 public:
  static Result<FileReader> open(const Source& source);
  const FileHeader& header() const;
  const std::vector<ChunkInfo>& chunks() const;
  bool has_stream(const StreamKey& key) const;
  uint64_t stream_bytes(const StreamKey& key) const;
  /// All parts of a stream, checksums verified, one after the other. Error: corrupt, naming chunk and place.
  Result<std::vector<std::byte>> read_stream(const StreamKey& key) const;
};

}  // namespace maille
