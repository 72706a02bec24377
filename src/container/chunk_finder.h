#pragma once

#include <maille/source.h>
#include <optional>
#include <string>
#include <vector>

#include "container/layout.h"

namespace maille {

/// Sentences about damage. Hostile files could fill memory with them, so only the first hundred are kept.
class Problems {
 public:
  void add(std::string sentence);
  const std::vector<std::string>& sentences() const { return sentences_; }

 private:
  std::vector<std::string> sentences_;
};

/// Bytes of a source near one another: straight from its view, or read 64 KiB at a time. With `ahead` 0,
/// where it is known what is wanted, no more than that is read: a distant source may have to fetch the rest.
class SourceWindow {
 public:
  static constexpr size_t usual = size_t{64} << 10;
  explicit SourceWindow(const Source& source, size_t ahead = usual) : source_(source), ahead_(ahead) {}
  /// At least min(size, bytes left in the file) bytes from `offset` on; valid until the next call.
  Result<Bytes> at(uint64_t offset, size_t size);
  /// At least the `size` bytes before `end`, by reading 64 KiB that end there: for going backwards.
  Result<Bytes> before(uint64_t end, size_t size);
  /// Forgets what was read.
  void drop() { buffer_.clear(); }

 private:
  const Source& source_;
  size_t ahead_;
  std::vector<std::byte> buffer_;
  uint64_t start_ = 0;
};

/// The chunks that the index at footer.index_offset lists, in file order, and before them those of the
/// footers before. Error: corrupt (which the caller answers by scanning), cannot_read.
Result<std::vector<ChunkRecord>> read_index(const Source& source, const Footer& footer);

/// Chunks found by scanning. `whole` of them stand before the last footer on the way that fits what is before
/// it; it ends at `whole_end`, 0 if there is none.
struct ScannedChunks {
  std::vector<ChunkRecord> records;
  size_t whole = 0;
  uint64_t whole_end = 0;
};
/// The chunks found by their headers from the end of the file header, whose bytes are given, up to `end`,
/// without the index's own. Looks at each byte once, whatever the file holds. Contents are not verified.
Result<ScannedChunks> scan_chunks(const Source& source, Bytes file_header, uint64_t end, Problems& problems);

}  // namespace maille
