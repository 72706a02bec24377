#pragma once

#include <maille/file.h>
#include <maille/source.h>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "container/layout.h"
#include "container/stream_source.h"

namespace maille {

/// Writes header, chunks, index, footer, front to back, to any sink. Memory: one chunk, and about 20 bytes
/// for each chunk written.
class FileWriter {
 public:
  /// Writes the header.
  static Result<FileWriter> begin(Sink& sink, const FileHeader& header);
  /// Goes on behind the footer of a complete file, at `end`, with its digest so far: chunks to come, an index
  /// of them, a footer of its own. The sink writes from there on. Writes nothing itself.
  static FileWriter resume(Sink& sink, uint64_t end, const Digest& digest);
  /// Writes chunks alone, which another writer takes in by count_chunks(): not to be finished.
  static FileWriter run(Sink& sink) { return {sink, Digest({})}; }
  /// What index and digest need to know of the chunks so far.
  Bytes records() const { return index_.bytes(); }
  /// Takes in chunks that somebody else puts at offset(), by their records: nothing is written. Error:
  /// corrupt.
  Result<> count_chunks(Bytes records);
  /// Cuts `bytes` into chunks of at most max_chunk_bytes and writes them. An empty stream is one empty chunk.
  /// A key is written once. A chunk costs 20 to 34 bytes beside its content, so many tiny streams are better
  /// one.
  Result<> write_stream(const StreamKey& key, Bytes bytes);
  /// The same of `size` bytes, with memory for one chunk: `read` fills a span with those from an offset on.
  Result<> write_stream(const StreamKey& key, uint64_t size,
                        const std::function<Result<>(uint64_t offset, std::span<std::byte>)>& read);
  /// Writes index and footer. Does not commit the sink, except, where the file goes on, before the footer:
  /// there must be no footer without what it vouches for. Returns the size of the file.
  Result<uint64_t> finish();
  /// Where the next chunk will stand.
  uint64_t offset() const { return offset_; }

 private:
  FileWriter(Sink& sink, const Digest& digest) : sink_(&sink), digest_(digest) {}
  Result<> write(Bytes bytes);
  Result<> write_part(const ChunkHeader& part, Bytes content);
  Result<uint64_t> write_chunk(const ChunkHeader& header, Bytes content);
  Result<> write_index();

  Sink* sink_;
  Digest digest_;
  ByteWriter index_;
  uint64_t offset_ = 0;
  bool resumed_ = false;
};

}  // namespace maille
