#include "container/packed_file.h"

#include <algorithm>
#include <optional>

#include "base/hash.h"
#include "base/result.h"
#include "container/file_writer.h"

namespace maille {
namespace {

constexpr uint32_t types_in_entry = 8;  // a power of two, with room for two types more
static_assert(packed_types.size() <= types_in_entry);

/// Of an entry's bytes and the content.
uint16_t check_of(Bytes entry, Bytes content) {
  std::vector<std::byte> both(entry.begin(), entry.end());
  both.insert(both.end(), content.begin(), content.end());
  return static_cast<uint16_t>(hash64(both));
}

/// Nothing where another patch, type or number has no entry.
std::optional<PackedEntry> entry_of(const NamedStream& stream) {
  const auto same = [&](const ChunkType& type) {
    return std::equal(type.begin(), type.end(), stream.key.type);
  };
  const auto type = std::find_if(packed_types.begin(), packed_types.end(), same);
  const bool fits = type != packed_types.end() && stream.key.patch == 0 &&
                    stream.key.number < UINT32_MAX / types_in_entry &&
                    stream.bytes.size() < most_packed_bytes;
  if (!fits) return std::nullopt;
  return PackedEntry{static_cast<uint32_t>(type - packed_types.begin()) + types_in_entry * stream.key.number,
                     static_cast<uint32_t>(stream.bytes.size())};
}

void put_stream(ByteWriter& out, const PackedEntry& entry, Bytes content) {
  const size_t begin = out.size();
  FieldWriter fields(out);
  PackedEntry::visit(entry, fields);
  out.put(check_of(Bytes(out.bytes()).subspan(begin), content));
  out.put_bytes(content);
}

/// Nothing where chunks are needed.
std::optional<std::vector<std::byte>> packed_file(FileHeader header, std::span<const NamedStream> streams) {
  if (header.mode != Mode::single) return std::nullopt;
  header.required_features |= packed_feature;
  ByteWriter out;
  out.put_bytes(write_file_header(header));
  for (const NamedStream& stream : streams) {
    const std::optional<PackedEntry> entry = entry_of(stream);
    if (!entry) return std::nullopt;
    put_stream(out, *entry, stream.bytes);
    if (out.size() + chunk_checksum_bytes > most_packed_bytes) return std::nullopt;
  }
  out.put(hash64(out.bytes()));
  return out.take();
}

/// Goes over one stream. Nothing where it is not whole, and where no other can follow `in` has failed.
std::optional<ChunkRecord> take_stream(Bytes file, ByteReader& in, Problems& problems) {
  const size_t begin = in.position();
  PackedEntry entry;
  FieldReader fields(in);
  PackedEntry::visit(entry, fields);
  const Bytes spelled = file.subspan(begin, in.position() - begin);
  const auto check = in.get<uint16_t>();
  const uint32_t type = entry.stream % types_in_entry;
  if (!fields.ok() || type >= packed_types.size()) {
    problems.add("bytes " + std::to_string(begin) + ".." + std::to_string(file.size()) +
                 " hold no intact stream");
    in.get_bytes(file.size());
    return std::nullopt;
  }
  const ChunkRecord record = {.header = {.type = packed_types[type],
                                         .number = entry.stream / types_in_entry,
                                         .part_and_last = 1,  // the first part, and the last
                                         .size = entry.size},
                              .offset = in.position()};
  const size_t left = in.remaining();
  const Bytes content = in.get_bytes(entry.size);
  if (!in.ok()) {
    problems.add(describe(record.header) + " is cut off: " + std::to_string(left) + " of its " +
                 std::to_string(entry.size) + " bytes are there (from byte " + std::to_string(record.offset) +
                 " on)");
    return std::nullopt;
  }
  if (checksum_matches(check, check_of(spelled, content))) return record;
  problems.add(describe(record.header) + ", bytes " + std::to_string(begin) + ".." +
               std::to_string(in.position()) + ": checksum mismatch: the file is damaged there");
  return std::nullopt;
}

bool checksum_is_right(Bytes file) {
  const Bytes covered = file.first(file.size() - chunk_checksum_bytes);
  return checksum_matches(load<uint64_t>(covered.data() + covered.size()), hash64(covered));
}

}  // namespace

Result<uint64_t> write_file(Sink& sink, FileHeader header, std::span<const NamedStream> streams) {
  if (const auto packed = packed_file(header, streams)) {
    MAILLE_CHECK(sink.write(*packed));
    return packed->size();
  }
  FileWriter writer = MAILLE_TRY(FileWriter::begin(sink, header));
  for (const NamedStream& stream : streams) MAILLE_CHECK(writer.write_stream(stream.key, stream.bytes));
  return writer.finish();
}

std::vector<ChunkRecord> find_packed(Bytes file, Problems& problems) {
  std::vector<ChunkRecord> records;
  ByteReader in(file);
  in.get_bytes(file_header_bytes);
  // Of a file that was cut off, a stream may reach into what would be the checksum.
  while (in.ok() && in.remaining() > chunk_checksum_bytes) {
    if (const auto record = take_stream(file, in, problems)) records.push_back(*record);
  }
  if (!problems.sentences().empty()) return records;
  if (in.remaining() != chunk_checksum_bytes) {
    problems.add("the end of the file is missing or damaged");
  } else if (!checksum_is_right(file)) {
    problems.add("bytes are damaged, missing or not of this file (checksum mismatch)");
  }
  return records;
}

}  // namespace maille
