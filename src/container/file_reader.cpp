#include "container/file_reader.h"

#include <algorithm>
#include <tuple>

#include "base/result.h"
#include "container/chunk_finder.h"
#include "container/packed_file.h"

namespace maille {
namespace {

std::string text(const ChunkType& type) {
  return std::string(type.begin(), type.end());
}

auto stream_of(const ChunkHeader& header) {
  return std::tuple(header.type, header.patch, header.number);
}

bool same_stream(const ChunkHeader& a, const ChunkHeader& b) {
  return stream_of(a) == stream_of(b);
}

std::string describe_stream(const StreamKey& key) {
  return "stream " + std::string(key.type, 4) + " (patch " + std::to_string(key.patch) + ", number " +
         std::to_string(key.number) + ")";
}

Result<std::vector<std::byte>> read_part(const Source& source, uint64_t offset, size_t size) {
  std::vector<std::byte> bytes(size);
  MAILLE_CHECK(source.read_at(offset, bytes));
  return bytes;
}

/// The footer belongs to this header and these chunks. By the headers and checksums alone: opening a file
/// takes no time for its contents, which are checked when they are read.
bool digest_matches(Bytes file_header, const std::vector<ChunkRecord>& records, const Footer& footer) {
  Digest digest(file_header);
  for (const ChunkRecord& record : records) digest.add_chunk(record.header, record.checksum);
  return checksum_matches(footer.digest, digest.finish(footer.index_offset));
}

bool is_critical(const ChunkType& type) {
  return type[0] >= 'A' && type[0] <= 'Z';
}

}  // namespace

Result<FileReader> FileReader::open(const Source& source, std::span<const std::string_view> known_types) {
  auto reader = open_once(source, known_types);
  const bool good = reader && reader->problems().empty();
  const bool damaged = reader ? !good : reader.error().code == ErrorCode::corrupt;
  // Once more, where it may have been the way here that damaged it.
  if (damaged && source.forget(0, source.size())) return open_once(source, known_types);
  return reader;
}

Result<FileReader> FileReader::open_once(const Source& source,
                                         std::span<const std::string_view> known_types) {
  FileReader reader(source);
  const auto size = static_cast<size_t>(std::min<uint64_t>(source.size(), file_header_bytes));
  const std::vector<std::byte> first_bytes = MAILLE_TRY(read_part(source, 0, size));
  reader.header_ = MAILLE_TRY(read_file_header(first_bytes, source.name()));
  const bool packed = (reader.header_.required_features & packed_feature) != 0;
  MAILLE_CHECK(packed ? reader.read_packed() : reader.find_chunks(first_bytes));
  MAILLE_CHECK(reader.check_types(known_types));
  reader.sort_streams();
  reader.check_parts();
  reader.list_chunks();
  return reader;
}

/// Fills records_, problems_ and complete_: by the index when there is one and all of it fits, else by
/// scanning.
Result<> FileReader::find_chunks(Bytes file_header) {
  uint64_t end = end_ = source_->size();
  std::optional<Footer> footer;
  if (end >= file_header_bytes + footer_bytes) {
    footer = read_footer(MAILLE_TRY(read_part(*source_, end - footer_bytes, footer_bytes)));
  }
  Problems problems;
  if (footer) {
    end -= footer_bytes;
  } else {
    problems.add("the end of the file is missing or damaged");
  }

  if (footer && footer->index_offset != 0) {
    Result<std::vector<ChunkRecord>> records = read_index(*source_, *footer);
    if (records && digest_matches(file_header, *records, *footer)) {
      records_ = *std::move(records);
      complete_ = true;
      return {};
    }
    if (!records && records.error().code != ErrorCode::corrupt) return tl::unexpected(records.error());
    problems.add(records ? "the index does not fit the footer; its chunks were found by scanning"
                         : records.error().message);
  }
  ScannedChunks found = MAILLE_TRY(scan_chunks(*source_, file_header, end, problems));
  records_ = std::move(found.records);
  complete_ = footer && digest_matches(file_header, records_, *footer);
  if (!complete_ && found.whole_end != 0) {
    // What was appended later is damaged, or was never finished: without it the file is whole.
    records_.resize(found.whole);
    complete_ = true;
    end_ = found.whole_end;
    problems = {};
    problems.add("what was appended from byte " + std::to_string(end_) +
                 " on is damaged, or was not finished; the file is read as it was before");
  } else if (footer && !complete_)
    problems.add("chunks are missing, damaged or not of this file (digest mismatch)");
  problems_ = problems.sentences();
  return {};
}

/// All of the file at once, so that damage is known as soon as it is open.
Result<> FileReader::read_packed() {
  end_ = source_->size();
  if (end_ > most_packed_bytes) {
    return failure(ErrorCode::corrupt, source_->name() + ": damaged: it is larger than a packed file may be");
  }
  packed_ = MAILLE_TRY(read_part(*source_, 0, static_cast<size_t>(end_)));
  Problems problems;
  records_ = find_packed(packed_, problems);
  problems_ = problems.sentences();
  complete_ = problems_.empty();
  return {};
}

Result<> FileReader::check_types(std::span<const std::string_view> known_types) const {
  if (known_types.empty()) return {};
  for (const ChunkRecord& record : records_) {
    const std::string type = text(record.header.type);
    if (!is_critical(record.header.type)) continue;
    if (std::find(known_types.begin(), known_types.end(), type) != known_types.end()) continue;
    return failure(ErrorCode::unsupported,
                   source_->name() + ": needs a newer maille: " + describe(record.header) + " at byte " +
                       std::to_string(record.offset) + " is of an unknown kind");
  }
  return {};
}

/// Chunks may come in any order, and there may be millions: parts are found by bisection.
void FileReader::sort_streams() {
  by_stream_.resize(records_.size());
  for (size_t i = 0; i < by_stream_.size(); ++i) by_stream_[i] = i;
  const auto key = [&](size_t i) {
    const ChunkHeader& header = records_[i].header;
    return std::tuple(stream_of(header), header.part(), i);
  };
  std::sort(by_stream_.begin(), by_stream_.end(), [&](size_t a, size_t b) { return key(a) < key(b); });
}

/// Every stream has each of its parts once, the last one marked.
void FileReader::check_parts() {
  Problems problems;
  for (size_t i = 0; i < by_stream_.size(); ++i) {
    const ChunkHeader& part = records_[by_stream_[i]].header;
    const ChunkHeader* before = i == 0 ? nullptr : &records_[by_stream_[i - 1]].header;
    const ChunkHeader* after = i + 1 == by_stream_.size() ? nullptr : &records_[by_stream_[i + 1]].header;
    if (before != nullptr && !same_stream(*before, part)) before = nullptr;
    if (after != nullptr && !same_stream(part, *after)) after = nullptr;
    if (before != nullptr && before->part() == part.part()) {
      problems.add(describe(part) + " is there twice");
    } else if (part.part() != (before == nullptr ? 0 : before->part() + 1)) {
      problems.add(describe(part) + ": the part before it is missing");
    }
    if (part.last() != (after == nullptr)) {
      problems.add(describe(part) +
                   (part.last() ? " claims to be the last part" : ": the part after it is missing"));
    }
  }
  if (!problems.sentences().empty()) complete_ = false;
  problems_.insert(problems_.end(), problems.sentences().begin(), problems.sentences().end());
}

void FileReader::list_chunks() {
  chunks_.reserve(records_.size());
  for (const ChunkRecord& record : records_) {
    const ChunkHeader& header = record.header;
    chunks_.push_back(
        {text(header.type), uint64_t{header.patch} << 32 | header.number, record.offset, header.size});
  }
}

Digest FileReader::digest() const {
  Digest digest(write_file_header(header_));
  for (const ChunkRecord& record : records_) digest.add_chunk(record.header, record.checksum);
  return digest;
}

Result<> FileReader::check_complete() const {
  if (complete_) return {};
  return failure(ErrorCode::corrupt, source_->name() + ": damaged or incomplete: " +
                                         (problems_.empty() ? "unknown damage" : problems_.front()));
}

std::span<const size_t> FileReader::parts_of(const StreamKey& key) const {
  ChunkType type;
  std::copy_n(key.type, type.size(), type.begin());
  const auto wanted = std::tuple(type, key.patch, key.number);
  const auto first =
      std::lower_bound(by_stream_.begin(), by_stream_.end(), wanted,
                       [&](size_t i, const auto& k) { return stream_of(records_[i].header) < k; });
  const auto last = std::upper_bound(first, by_stream_.end(), wanted, [&](const auto& k, size_t i) {
    return k < stream_of(records_[i].header);
  });
  return std::span(by_stream_)
      .subspan(static_cast<size_t>(first - by_stream_.begin()), static_cast<size_t>(last - first));
}

bool FileReader::has_stream(const StreamKey& key) const {
  return !parts_of(key).empty();
}

uint64_t FileReader::stream_bytes(const StreamKey& key) const {
  uint64_t bytes = 0;
  for (const size_t i : parts_of(key)) bytes += records_[i].header.size;
  return bytes;
}

uint64_t FileReader::content_offset(const ChunkRecord& record) const {
  if (!packed_.empty()) return record.offset;
  return record.offset + chunk_total_bytes(record.header) - record.header.size - chunk_checksum_bytes;
}

Result<Bytes> FileReader::read_content(SourceWindow& window, const ChunkRecord& record) const {
  if (!packed_.empty())
    return Bytes(packed_).subspan(static_cast<size_t>(content_offset(record)), record.header.size);
  const auto size = static_cast<size_t>(chunk_total_bytes(record.header));
  for (bool first = true;; first = false) {
    const Bytes chunk = MAILLE_TRY(window.at(record.offset, size));
    if (chunk.size() >= size) {
      if (const std::optional<Bytes> content = chunk_content(chunk.first(size), record)) return *content;
    }
    // A distant source keeps what it fetched: damage on the way would come back each time.
    if (!first || !source_->forget(record.offset, size)) break;
    window.drop();
  }
  return failure(ErrorCode::corrupt, source_->name() + ": " + describe(record.header) + ", bytes " +
                                         std::to_string(record.offset) + ".." +
                                         std::to_string(record.offset + size) +
                                         ": checksum mismatch: the file is damaged there");
}

Result<std::vector<std::byte>> FileReader::read_chunk(const ChunkRecord& record) const {
  SourceWindow window(*source_, 0);
  const Bytes content = MAILLE_TRY(read_content(window, record));
  return std::vector<std::byte>(content.begin(), content.end());
}

/// Are all its parts there?
Result<> FileReader::check_stream(const StreamKey& key) const {
  const std::span<const size_t> parts = parts_of(key);
  bool whole = !parts.empty();
  for (size_t i = 0; i < parts.size(); ++i) {
    const ChunkHeader& part = records_[parts[i]].header;
    whole = whole && part.part() == i && part.last() == (i + 1 == parts.size());
  }
  if (whole) return {};
  return failure(ErrorCode::corrupt, source_->name() + ": " + describe_stream(key) +
                                         (parts.empty() ? " is missing" : " lacks a part or has one twice") +
                                         (problems_.empty() ? "" : ": " + problems_.front()));
}

Result<std::vector<std::byte>> FileReader::read_unchecked(const StreamKey& key) const {
  MAILLE_CHECK(check_stream(key));
  std::vector<std::byte> stream;
  for (const size_t i : parts_of(key)) {
    const ChunkRecord& record = records_[i];
    const auto part = MAILLE_TRY(read_part(*source_, content_offset(record), record.header.size));
    stream.insert(stream.end(), part.begin(), part.end());
  }
  return stream;
}

Result<std::vector<std::byte>> FileReader::read_stream(const StreamKey& key) const {
  MAILLE_CHECK(check_stream(key));
  const std::span<const size_t> parts = parts_of(key);
  std::vector<std::byte> stream;
  stream.reserve(static_cast<size_t>(stream_bytes(key)));  // chunks do not overlap: less than the file
  SourceWindow window(*source_, 0);
  for (const size_t i : parts) {
    const Bytes content = MAILLE_TRY(read_content(window, records_[i]));
    stream.insert(stream.end(), content.begin(), content.end());
  }
  return stream;
}

}  // namespace maille
