#include "volume/stream/chunk_pull.h"

#include <algorithm>
#include <cerrno>

#include "base/result.h"
#include "base/system.h"

namespace maille {

/// Moves what is still needed (from the mark on) to the front of the buffer, then reads until there is
/// enough. The buffer grows with the largest chunk and what the mark keeps, never by a claim alone: `size` is
/// capped by the format.
Result<Bytes> ChunkPull::window(size_t size) {
  if (end_ - at_.begin < size) {
    const size_t kept = mark_.begin;
    std::copy(buffer_.begin() + static_cast<ptrdiff_t>(kept), buffer_.begin() + static_cast<ptrdiff_t>(end_),
              buffer_.begin());
    end_ -= kept;
    at_.begin -= kept;
    mark_.begin = 0;
    const size_t wanted = at_.begin + size;
    if (buffer_.size() < wanted) buffer_.resize(std::max<size_t>(wanted, size_t{64} << 10));
    while (end_ < wanted) {
      const size_t count = MAILLE_TRY(bytes_->read(std::span(buffer_).subspan(end_)));
      if (count == 0) break;
      end_ += count;
    }
  }
  return Bytes(buffer_).subspan(at_.begin, std::min(size, end_ - at_.begin));
}

void ChunkPull::mark() {
  mark_ = at_;
}

void ChunkPull::rewind() {
  at_ = mark_;
}

// The digest of a file begins with its header, so that the footer vouches for it.
Result<FileHeader> ChunkPull::begin() {
  const Bytes bytes = MAILLE_TRY(window(file_header_bytes));
  const FileHeader header = MAILLE_TRY(read_file_header(bytes, name()));
  at_.digest.emplace(bytes);
  at_.begin += file_header_bytes;
  at_.offset = file_header_bytes;
  return header;
}

Result<bool> ChunkPull::next(ChunkHeader& header, Bytes& content) {
  for (;;) {
    // A pipe may hold less than the longest header, because the next batch is still being made: from the size
    // of a footer on, one byte more is asked for until the header is whole.
    std::optional<ParsedChunkHeader> parsed;
    for (size_t size = footer_bytes; !parsed && size <= max_chunk_header_bytes; ++size) {
      parsed = read_chunk_header(MAILLE_TRY(window(size)));
    }
    if (!parsed) {
      MAILLE_CHECK(check_end());
      return false;
    }
    const auto total = static_cast<size_t>(parsed->total_bytes());
    const Bytes chunk = MAILLE_TRY(window(total));
    ChunkRecord record = {parsed->header, at_.offset, 0};
    // A chunk that is cut off is an error of its own, not a wrong sum.
    if (chunk.size() == total) record.checksum = load<uint64_t>(chunk.data() + total - chunk_checksum_bytes);
    const auto found = chunk.size() == total ? chunk_content(chunk, record) : std::nullopt;
    // What readers pass over is not missed here: who wants it reads it by its key, and is told.
    const bool ancillary = parsed->header.type[0] >= 'a' && chunk.size() == total;
    if (!found && !ancillary) {
      const std::string what = chunk.size() < total ? "is cut off" : "is damaged";
      return failure(ErrorCode::corrupt, name() + ": " + describe(parsed->header) + " at byte " +
                                             std::to_string(at_.offset) + " " + what);
    }
    const bool of_index = parsed->header.type == index_type;
    if (of_index && at_.index_offset == 0) at_.index_offset = at_.offset;
    // The index is no part of the digest, as it says nothing new.
    at_.offset += total;
    at_.begin += total;
    if (of_index) continue;
    at_.digest->add_chunk(parsed->header, record.checksum);
    header = parsed->header;
    content = found.value_or(Bytes());
    return true;
  }
}

/// The footer must be here, and nothing but another part of the file behind it.
Result<> ChunkPull::check_end() {
  // Behind the footer something may have been appended: chunks, which are not the mesh's.
  const Bytes rest = MAILLE_TRY(window(footer_bytes + 1));
  const bool ends =
      rest.size() == footer_bytes ||
      (rest.size() > footer_bytes && static_cast<uint8_t>(rest[footer_bytes]) == chunk_marker[0]);
  const auto footer = ends ? read_footer(rest.first(footer_bytes)) : std::nullopt;
  if (!footer || !checksum_matches(footer->digest, at_.digest->finish(footer->index_offset)) ||
      footer->index_offset != at_.index_offset) {
    return failure(ErrorCode::corrupt, name() + ": damaged or cut off at byte " + std::to_string(at_.offset));
  }
  return {};
}

namespace {

// A pipe or file that the caller has opened and closes.
class DescriptorStream final : public ByteStream {
 public:
  DescriptorStream(int descriptor, std::string name) : descriptor_(descriptor), name_(std::move(name)) {}
  Result<size_t> read(std::span<std::byte> out) override {
    const ptrdiff_t count = read_some(descriptor_, out);
    if (count < 0) return cannot_read(name_);
    return static_cast<size_t>(count);
  }
  std::string name() const override { return name_; }

 private:
  int descriptor_;
  std::string name_;
};

// A source from front to back. Its size was known when it was opened; a file that shrinks gives an error of
// the source.
class SourceStream final : public ByteStream {
 public:
  explicit SourceStream(const Source& source) : source_(source) {}
  Result<size_t> read(std::span<std::byte> out) override {
    const auto count = static_cast<size_t>(std::min<uint64_t>(out.size(), source_.size() - at_));
    MAILLE_CHECK(source_.read_at(at_, out.first(count)));
    at_ += count;
    return count;
  }
  std::string name() const override { return source_.name(); }

 private:
  const Source& source_;
  uint64_t at_ = 0;
};

}  // namespace

std::unique_ptr<ByteStream> descriptor_stream(int descriptor, std::string name) {
  return std::make_unique<DescriptorStream>(descriptor, std::move(name));
}

std::unique_ptr<ByteStream> source_stream(const Source& source) {
  return std::make_unique<SourceStream>(source);
}

}  // namespace maille
