#include "container/chunk_finder.h"

#include <algorithm>
#include <cstring>

#include "base/result.h"

namespace maille {
namespace {

/// More than anybody reads, and less than 20 kB of sentences; chosen, not measured.
constexpr size_t max_problems = 100;

tl::unexpected<Error> bad_index(const std::string& what) {
  return failure(ErrorCode::corrupt,
                 "the index is damaged (" + what + "); its chunks were found by scanning");
}

/// The content of all index chunks, which fill the file from footer.index_offset to the footer at `end`.
Result<std::vector<std::byte>> read_index_bytes(SourceWindow& window, const Footer& footer, uint64_t end) {
  std::vector<std::byte> bytes;
  if (footer.index_offset < file_header_bytes || footer.index_offset > end) return bad_index("its place");
  uint64_t offset = footer.index_offset;
  for (uint32_t part = 0; offset < end; ++part) {
    const auto parsed = read_chunk_header(MAILLE_TRY(window.at(offset, max_chunk_header_bytes)));
    if (!parsed || parsed->header.type != index_type || parsed->total_bytes() > end - offset) {
      return bad_index("a header in it");
    }
    const uint64_t next = offset + parsed->total_bytes();
    if (parsed->header.part() != part || parsed->header.last() != (next == end))
      return bad_index("its parts");
    const auto size = static_cast<size_t>(parsed->total_bytes());
    const Bytes chunk = MAILLE_TRY(window.at(offset, size)).first(size);
    const auto checksum = load<uint64_t>(chunk.data() + chunk.size() - chunk_checksum_bytes);
    const auto content = chunk_content(chunk, {parsed->header, offset, checksum});
    if (!content) return bad_index("checksum mismatch");
    bytes.insert(bytes.end(), content->begin(), content->end());
    offset = next;
  }
  return bytes;
}

/// A search for chunks by their markers. Contents may hold whole .maille files: what is inside a chunk is
/// never looked at, as long as the chunk's own header is whole.
class Scan {
 public:
  Scan(const Source& source, Bytes file_header, uint64_t end, Problems& problems)
      : window_(source), digest_(file_header), end_(end), problems_(problems) {}

  Result<ScannedChunks> run() {
    uint64_t offset = file_header_bytes;
    while (offset < end_) {
      if (const auto next = MAILLE_TRY(take_chunk(offset))) {
        report_gap(offset);
        gap_start_ = offset = *next;
      } else if (MAILLE_TRY(take_footer(offset))) {
        report_gap(offset);
        gap_start_ = offset = offset + footer_bytes;
      } else {
        offset = MAILLE_TRY(find_marker(offset + 1));
      }
    }
    report_gap(end_);
    return std::move(found_);
  }

 private:
  /// Records the chunk at `offset`; gives where it ends, or nothing when no whole chunk is there.
  Result<std::optional<uint64_t>> take_chunk(uint64_t offset) {
    const auto parsed = read_chunk_header(MAILLE_TRY(window_.at(offset, max_chunk_header_bytes)));
    if (!parsed) return std::nullopt;
    const uint64_t total = parsed->total_bytes();
    if (total > end_ - offset) {
      problems_.add(describe(parsed->header) + " is cut off: " + std::to_string(end_ - offset) + " of its " +
                    std::to_string(total) + " bytes are there (from byte " + std::to_string(offset) + " on)");
      gap_start_ = end_;  // told already
      return std::nullopt;
    }
    if (parsed->header.type == index_type) return offset + total;
    // Contents are not read here: a scan of a file of gigabytes would take as long as decoding it.
    const uint64_t checksum_offset = offset + total - chunk_checksum_bytes;
    const Bytes tail = MAILLE_TRY(window_.at(checksum_offset, chunk_checksum_bytes));
    found_.records.push_back({parsed->header, offset, load<uint64_t>(tail.data())});
    digest_.add_chunk(parsed->header, found_.records.back().checksum);
    return offset + total;
  }

  /// The footer of a file to which something was appended later.
  Result<bool> take_footer(uint64_t offset) {
    if (offset + footer_bytes > end_) return false;
    const auto footer = read_footer(MAILLE_TRY(window_.at(offset, footer_bytes)));
    // Only the digest tells a footer from bytes that look like one, so it also counts in builds for fuzzing.
    if (!footer || footer->digest != digest_.finish(footer->index_offset)) return false;
    found_.whole = found_.records.size();
    found_.whole_end = offset + footer_bytes;
    return true;
  }

  Result<uint64_t> find_marker(uint64_t offset) {
    while (offset < end_) {
      Bytes bytes = MAILLE_TRY(window_.at(offset, 1));
      bytes = bytes.first(static_cast<size_t>(std::min<uint64_t>(bytes.size(), end_ - offset)));
      // The first byte alone: the second may stand behind the window.
      const void* const hit = std::memchr(bytes.data(), chunk_marker[0], bytes.size());
      if (hit != nullptr)
        return offset + static_cast<uint64_t>(static_cast<const std::byte*>(hit) - bytes.data());
      offset += bytes.size();
    }
    return end_;
  }

  void report_gap(uint64_t gap_end) {
    if (gap_end <= gap_start_) return;
    problems_.add("bytes " + std::to_string(gap_start_) + ".." + std::to_string(gap_end) +
                  " hold no intact chunk header");
  }

  SourceWindow window_;
  Digest digest_;
  uint64_t end_;
  Problems& problems_;
  ScannedChunks found_;
  uint64_t gap_start_ = file_header_bytes;
};

}  // namespace

void Problems::add(std::string sentence) {
  if (sentences_.size() < max_problems) sentences_.push_back(std::move(sentence));
  if (sentences_.size() == max_problems) sentences_.back() = "and more of the kind";
}

Result<Bytes> SourceWindow::at(uint64_t offset, size_t size) {
  const uint64_t left = source_.size() - offset;
  // What is in memory already is given as a whole, so that nobody asks again.
  if (const Bytes all = source_.view(); !all.empty()) return all.subspan(static_cast<size_t>(offset));
  const uint64_t end = offset + std::min<uint64_t>(size, left);
  if (offset < start_ || end > start_ + buffer_.size()) {
    buffer_.resize(static_cast<size_t>(std::min<uint64_t>(std::max(size, ahead_), left)));
    start_ = offset;
    if (auto read = source_.read_at(offset, buffer_); !read) {
      drop();
      return tl::unexpected(std::move(read).error());
    }
  }
  return Bytes(buffer_).subspan(static_cast<size_t>(offset - start_));
}

Result<Bytes> SourceWindow::before(uint64_t end, size_t size) {
  const uint64_t offset = end - size;
  if (offset < start_ || end > start_ + buffer_.size()) {
    const auto count = static_cast<size_t>(std::min<uint64_t>(end, std::max(size, ahead_)));
    MAILLE_CHECK(at(end - count, count));
  }
  return at(offset, size);
}

namespace {

/// The chunks that one index lists, which stand one after the other up to it. `begin`: where the first does.
Result<std::vector<ChunkRecord>> read_one_index(SourceWindow& window, const Footer& footer, uint64_t end,
                                                uint64_t& begin) {
  const std::vector<std::byte> bytes = MAILLE_TRY(read_index_bytes(window, footer, end));
  std::vector<ChunkRecord> records;
  ByteReader in(bytes);
  uint64_t size = 0;
  while (in.remaining() > 0) {
    ChunkRecord record;
    FieldReader fields(in);
    ChunkHeader::visit(record.header, fields);
    record.checksum = in.get<uint64_t>();
    if (!fields.ok()) return bad_index("an entry");
    // Chunks stand one after the other without gaps: places follow from sizes, so no entry can overlap
    // another.
    record.offset = size;
    size += chunk_total_bytes(record.header);
    if (size > footer.index_offset - file_header_bytes) return bad_index("more chunks than the file holds");
    records.push_back(record);
  }
  begin = footer.index_offset - size;
  for (ChunkRecord& record : records) record.offset += begin;
  return records;
}

}  // namespace

Result<std::vector<ChunkRecord>> read_index(const Source& source, const Footer& footer) {
  // From the last one to the first: each index lists what came since the footer before it.
  std::vector<std::vector<ChunkRecord>> parts;
  std::optional<Footer> next = footer;
  uint64_t end = source.size() - footer_bytes;
  SourceWindow window(source);
  for (uint64_t begin = 0;; end = begin - footer_bytes) {
    parts.push_back(MAILLE_TRY(read_one_index(window, *next, end, begin)));
    if (begin == file_header_bytes) break;
    if (begin < file_header_bytes + footer_bytes) return bad_index("fewer chunks than the file holds");
    // The index of which stands before it: mostly read along.
    next = read_footer(MAILLE_TRY(window.before(begin, footer_bytes)));
    if (!next) return bad_index("fewer chunks than the file holds");
    if (next->index_offset != 0) continue;
    // Only the first part of a continued file can be small enough to have no index: the scan is short.
    Problems problems;
    std::vector<std::byte> file_header(file_header_bytes);
    MAILLE_CHECK(source.read_at(0, file_header));
    parts.push_back(MAILLE_TRY(scan_chunks(source, file_header, begin - footer_bytes, problems)).records);
    if (!problems.sentences().empty()) return bad_index("fewer chunks than the file holds");
    break;
  }
  std::vector<ChunkRecord> records;
  for (auto part = parts.rbegin(); part != parts.rend(); ++part)
    records.insert(records.end(), part->begin(), part->end());
  return records;
}

Result<ScannedChunks> scan_chunks(const Source& source, Bytes file_header, uint64_t end, Problems& problems) {
  return Scan(source, file_header, end, problems).run();
}

}  // namespace maille
