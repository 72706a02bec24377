#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "container/file_writer.h"
#include "container/stream_source.h"

namespace maille {

class SourceWindow;

/// Opens a file, finds its chunks by the index or, when that is damaged, by scanning; gives streams back
/// whole. Safe on any input: time and memory are bounded by the size of the file, not by what it claims.
/// Calls on one reader may come from several threads. The source must outlive it.
class FileReader final : public StreamSource {
 public:
  /// `known_types`: the chunk types the caller can read; a file with an unknown critical one is refused.
  /// Empty: all are let through. Errors: cannot_read; corrupt when the header is damaged or it is no .maille
  /// file; unsupported when the file needs another maille. A file damaged or cut off behind its header does
  /// open: see complete().
  static Result<FileReader> open(const Source& source, std::span<const std::string_view> known_types = {});

  const FileHeader& header() const { return header_; }
  /// Of the source, which errors begin with.
  std::string name() const { return source_->name(); }
  /// In file order, without the index. `id` is the patch (high 32 bits) and the stream's number (low 32
  /// bits).
  const std::vector<ChunkInfo>& chunks() const { return chunks_; }

  /// Whether every chunk that was written is there. (Whether its content is intact shows when it is read.)
  bool complete() const { return complete_; }
  /// What is damaged, one sentence each, as far as headers, index and footer tell. May be non-empty although
  /// complete(): then only redundant bytes were hit.
  const std::vector<std::string>& problems() const { return problems_; }
  /// Error: corrupt, with the first problem, unless complete().
  Result<> check_complete() const;

  /// Where a complete file ends; behind it may stand what somebody began to append.
  uint64_t end() const { return end_; }
  /// Over the chunks so far, to go on from there.
  Digest digest() const;

  bool has_stream(const StreamKey& key) const override;
  uint64_t stream_bytes(const StreamKey& key) const;
  /// All parts of a stream, checksums verified, one after the other. Error: corrupt, naming chunk and place.
  Result<std::vector<std::byte>> read_stream(const StreamKey& key) const override;
  /// The same for streams whose content has checks of its own: damaged parts come as they are. Error:
  /// corrupt, when parts are missing.
  Result<std::vector<std::byte>> read_unchecked(const StreamKey& key) const;

  /// Place, key and checksum of each chunk, in the order of chunks().
  const std::vector<ChunkRecord>& records() const { return records_; }
  /// Where the content of one of records() begins.
  uint64_t content_offset(const ChunkRecord& record) const;
  /// The content of one of records(), verified. Error: corrupt, naming chunk and place; cannot_read.
  Result<std::vector<std::byte>> read_chunk(const ChunkRecord& record) const;

 private:
  explicit FileReader(const Source& source) : source_(&source) {}
  static Result<FileReader> open_once(const Source& source, std::span<const std::string_view> known_types);
  Result<> find_chunks(Bytes file_header);
  Result<> read_packed();
  Result<> check_types(std::span<const std::string_view> known_types) const;
  void sort_streams();
  void check_parts();
  void list_chunks();
  Result<Bytes> read_content(SourceWindow& window, const ChunkRecord& record) const;
  std::span<const size_t> parts_of(const StreamKey& key) const;
  Result<> check_stream(const StreamKey& key) const;

  const Source* source_;
  FileHeader header_;
  bool complete_ = false;
  uint64_t end_ = 0;
  std::vector<std::string> problems_;
  std::vector<ChunkRecord> records_;
  std::vector<size_t> by_stream_;  ///< places in records_, by type, patch, number, part
  std::vector<ChunkInfo> chunks_;
  std::vector<std::byte> packed_;  ///< all bytes of a packed file, else none
};

}  // namespace maille
