#include "container/file_writer.h"

#include <algorithm>

#include "base/hash.h"
#include "base/result.h"

namespace maille {
namespace {

ChunkType type_of(const StreamKey& key) {
  ChunkType type;
  std::copy_n(key.type, type.size(), type.begin());
  return type;
}

/// Calls `write(header, content)` for each part of a stream; once for a stream without bytes, which must be
/// told from one that is missing.
template <class Write>
Result<> for_each_part(ChunkHeader header, Bytes bytes, Write write) {
  for (uint32_t part = 0;; ++part) {
    const Bytes content = bytes.first(std::min<size_t>(bytes.size(), max_chunk_bytes));
    bytes = bytes.subspan(content.size());
    header.part_and_last = 2 * part + (bytes.empty() ? 1 : 0);
    header.size = static_cast<uint32_t>(content.size());
    MAILLE_CHECK(write(header, content));
    if (bytes.empty()) return {};
  }
}

}  // namespace

Result<FileWriter> FileWriter::begin(Sink& sink, const FileHeader& header) {
  const std::vector<std::byte> bytes = write_file_header(header);
  FileWriter writer(sink, Digest(bytes));
  MAILLE_CHECK(writer.write(bytes));
  return writer;
}

FileWriter FileWriter::resume(Sink& sink, uint64_t end, const Digest& digest) {
  FileWriter writer(sink, digest);
  writer.offset_ = end;
  writer.resumed_ = true;
  return writer;
}

Result<> FileWriter::write_stream(const StreamKey& key, Bytes bytes) {
  const ChunkHeader header = {.type = type_of(key), .patch = key.patch, .number = key.number};
  return for_each_part(header, bytes,
                       [&](const ChunkHeader& part, Bytes content) { return write_part(part, content); });
}

Result<> FileWriter::write_stream(
    const StreamKey& key, uint64_t size,
    const std::function<Result<>(uint64_t offset, std::span<std::byte>)>& read) {
  ChunkHeader header = {.type = type_of(key), .patch = key.patch, .number = key.number};
  std::vector<std::byte> content;
  for (uint64_t at = 0, part = 0; part == 0 || at < size; at += content.size(), ++part) {
    content.resize(std::min<uint64_t>(size - at, max_chunk_bytes));
    MAILLE_CHECK(read(at, content));
    header.part_and_last = static_cast<uint32_t>(2 * part + (at + content.size() == size ? 1 : 0));
    header.size = static_cast<uint32_t>(content.size());
    MAILLE_CHECK(write_part(header, content));
  }
  return {};
}

Result<> FileWriter::count_chunks(Bytes records) {
  ByteReader in(records);
  while (in.remaining() > 0 && in.ok()) {
    ChunkRecord record;
    FieldReader fields(in);
    ChunkHeader::visit(record.header, fields);
    record.checksum = in.get<uint64_t>();
    digest_.add_chunk(record.header, record.checksum);
    offset_ += chunk_total_bytes(record.header);
  }
  if (!in.ok()) return failure(ErrorCode::corrupt, "the records of chunks are damaged");
  index_.put_bytes(records);
  return {};
}

Result<> FileWriter::write_part(const ChunkHeader& part, Bytes content) {
  const uint64_t checksum = MAILLE_TRY(write_chunk(part, content));
  digest_.add_chunk(part, checksum);
  FieldWriter fields(index_);
  ChunkHeader::visit(part, fields);
  index_.put(checksum);
  return {};
}

Result<uint64_t> FileWriter::finish() {
  Footer footer;
  // What is appended needs an index whatever its size: the index says where the footer before it stands.
  if (offset_ >= indexed_file_bytes || resumed_) {
    footer.index_offset = offset_;
    MAILLE_CHECK(write_index());
  }
  // The file stays whole without what is appended, until a footer on the disk says that all of it is there.
  if (resumed_) MAILLE_CHECK(sink_->commit());
  footer.digest = digest_.finish(footer.index_offset);
  MAILLE_CHECK(write(write_footer(footer)));
  return offset_;
}

Result<> FileWriter::write(Bytes bytes) {
  MAILLE_CHECK(sink_->write(bytes));
  offset_ += bytes.size();
  return {};
}

/// One write per chunk, and its checksum returned.
Result<uint64_t> FileWriter::write_chunk(const ChunkHeader& header, Bytes content) {
  std::vector<std::byte> chunk = write_chunk_header(header);
  chunk.reserve(chunk.size() + content.size() + chunk_checksum_bytes);
  chunk.insert(chunk.end(), content.begin(), content.end());
  const uint64_t checksum = hash64(chunk);
  chunk.resize(chunk.size() + chunk_checksum_bytes);
  store(chunk.data() + chunk.size() - chunk_checksum_bytes, checksum);
  MAILLE_CHECK(write(chunk));
  return checksum;
}

Result<> FileWriter::write_index() {
  const ChunkHeader header = {.type = index_type};
  return for_each_part(header, index_.bytes(), [&](const ChunkHeader& part, Bytes content) -> Result<> {
    MAILLE_TRY(write_chunk(part, content));
    return {};
  });
}

}  // namespace maille
