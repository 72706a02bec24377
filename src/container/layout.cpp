#include "container/layout.h"

#include <maille/version.h>
#include <algorithm>

#include "base/hash.h"
#include "base/result.h"

namespace maille {
namespace {

template <size_t N>
Bytes bytes_of(const std::array<uint8_t, N>& array) {
  return std::as_bytes(std::span(array));
}

bool starts_with(Bytes bytes, Bytes prefix) {
  return bytes.size() >= prefix.size() && std::equal(prefix.begin(), prefix.end(), bytes.begin());
}

/// A scan of damaged bytes meets a marker by chance every 64 KiB, and a header that fits then every 4 GiB.
uint16_t header_check(Bytes header) {
  return static_cast<uint16_t>(hash64(header));
}

bool is_chunk_type(const ChunkType& type) {
  const auto letter = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); };
  const auto letter_or_digit = [&](char c) { return letter(c) || (c >= '0' && c <= '9'); };
  return letter(type[0]) && std::all_of(type.begin(), type.end(), letter_or_digit);
}

Result<> check_magic(Bytes bytes, const std::string& name) {
  const Bytes magic = bytes_of(file_magic);
  if (starts_with(bytes, magic)) return {};
  if (bytes.empty()) return failure(ErrorCode::corrupt, name + ": not a .maille file: it is empty");
  if (bytes.size() < magic.size() && starts_with(magic, bytes)) {
    return failure(ErrorCode::corrupt, name + ": cut off within its header");
  }
  // The end of the magic has both line ends and the end-of-file of DOS for this, as PNG's has.
  if (starts_with(bytes, magic.first(4))) {
    return failure(ErrorCode::corrupt,
                   name + ": damaged by a transfer that rewrote line ends; transfer it again in binary mode");
  }
  return failure(ErrorCode::corrupt, name + ": not a .maille file: it does not start with the magic bytes");
}

std::string version_text(unsigned major, unsigned minor) {
  return std::to_string(major) + "." + std::to_string(minor);
}

Result<> check_version(const FileHeader& header, const std::string& name) {
  const std::string needs = name + ": needs a newer maille: ";
  const std::string file = "format " + version_text(header.major, header.minor);
  // Before 1.0 every minor version may change anything.
  const bool any_change = format_major == 0 && header.major == 0;
  const std::string reads = ", this maille reads " + version_text(format_major, format_minor);
  if (header.major > format_major || (any_change && header.minor > format_minor)) {
    return failure(ErrorCode::unsupported, needs + "the file has " + file + reads);
  }
  if (any_change && header.minor < format_minor) {
    return failure(ErrorCode::unsupported, name + ": needs an older maille: the file has " + file + reads);
  }
  const uint32_t unknown = header.required_features & ~known_required_features;
  if (unknown != 0) {
    return failure(ErrorCode::unsupported, needs + "the file (" + file +
                                               ") uses features this one does not know (bits " +
                                               std::to_string(unknown) + ")");
  }
  if (header.mode > Mode::random) {
    return failure(ErrorCode::unsupported, needs + "the file (" + file + ") has the unknown mode " +
                                               std::to_string(static_cast<unsigned>(header.mode)));
  }
  // Files of other modes are read by their chunks, before all of them is there.
  if ((header.required_features & packed_feature) != 0 && header.mode != Mode::single) {
    return failure(ErrorCode::unsupported, needs + "this one knows only files of mode \"single\" as packed");
  }
  return {};
}

}  // namespace

std::vector<std::byte> write_file_header(const FileHeader& header) {
  ByteWriter out;
  out.put_bytes(bytes_of(file_magic));
  FieldWriter fields(out);
  FileHeader::visit(header, fields);
  out.put(static_cast<uint32_t>(hash64(out.bytes())));
  return out.take();
}

Result<FileHeader> read_file_header(Bytes first_bytes, const std::string& name) {
  MAILLE_CHECK(check_magic(first_bytes, name));
  if (first_bytes.size() < file_header_bytes) {
    return failure(ErrorCode::corrupt, name + ": cut off within its header");
  }
  ByteReader in(first_bytes.first(file_header_bytes));
  in.get_bytes(file_magic.size());
  FileHeader header;
  FieldReader fields(in);
  FileHeader::visit(header, fields);
  const auto computed = static_cast<uint32_t>(hash64(first_bytes.first(in.position())));
  if (!checksum_matches(in.get<uint32_t>(), computed)) {
    return failure(ErrorCode::corrupt, name + ": header (bytes 0..25): checksum mismatch");
  }
  MAILLE_CHECK(check_version(header, name));
  return header;
}

std::vector<std::byte> write_chunk_header(const ChunkHeader& header) {
  ByteWriter out;
  out.put_bytes(bytes_of(chunk_marker));
  FieldWriter fields(out);
  ChunkHeader::visit(header, fields);
  out.put(header_check(out.bytes()));
  return out.take();
}

std::optional<ParsedChunkHeader> read_chunk_header(Bytes bytes) {
  if (!starts_with(bytes, bytes_of(chunk_marker))) return std::nullopt;
  ByteReader in(bytes.first(std::min(bytes.size(), max_chunk_header_bytes)));
  in.get_bytes(chunk_marker.size());
  ParsedChunkHeader parsed;
  FieldReader fields(in);
  ChunkHeader::visit(parsed.header, fields);
  const size_t checked = in.position();
  const auto stored = in.get<uint16_t>();
  if (!fields.ok() || !is_chunk_type(parsed.header.type)) return std::nullopt;
  if (!checksum_matches(stored, header_check(bytes.first(checked)))) return std::nullopt;
  parsed.header_bytes = in.position();
  // A count has one spelling, so that a chunk's place follows from the fields alone.
  if (chunk_total_bytes(parsed.header) != parsed.total_bytes()) return std::nullopt;
  return parsed;
}

uint64_t chunk_total_bytes(const ChunkHeader& header) {
  FieldSizer sizer;
  ChunkHeader::visit(header, sizer);
  return chunk_marker.size() + sizer.bytes() + sizeof(uint16_t) + header.size + chunk_checksum_bytes;
}

std::optional<Bytes> chunk_content(Bytes bytes, const ChunkRecord& record) {
  const std::optional<ParsedChunkHeader> parsed = read_chunk_header(bytes);
  if (!parsed || parsed->total_bytes() != bytes.size()) return std::nullopt;
  // What the index says must be what stands there: a chunk in another's place has a right checksum, too.
  const std::vector<std::byte> expected = write_chunk_header(record.header);
  if (write_chunk_header(parsed->header) != expected) return std::nullopt;

  const Bytes covered = bytes.first(bytes.size() - chunk_checksum_bytes);
  const auto stored = load<uint64_t>(covered.data() + covered.size());
  if (!checksum_matches(stored, hash64(covered)) || !checksum_matches(stored, record.checksum)) {
    return std::nullopt;
  }
  return covered.subspan(parsed->header_bytes);
}

std::vector<std::byte> write_footer(const Footer& footer) {
  ByteWriter out;
  FieldWriter fields(out);
  Footer::visit(footer, fields);
  out.put_bytes(bytes_of(end_magic));
  return out.take();
}

std::optional<Footer> read_footer(Bytes last_bytes) {
  ByteReader in(last_bytes);
  Footer footer;
  FieldReader fields(in);
  Footer::visit(footer, fields);
  const bool ends = starts_with(in.get_bytes(end_magic.size()), bytes_of(end_magic));
  if (!ends || !in.ok()) return std::nullopt;
  return footer;
}

Digest::Digest(Bytes file_header) : value_(hash64(file_header)) {}

/// A chain rather than a hash of all at the end: its state is eight bytes, whatever has been written.
void Digest::add_chunk(const ChunkHeader& header, uint64_t checksum) {
  ByteWriter link;
  link.put(value_);
  link.put_bytes(write_chunk_header(header));
  link.put(checksum);
  value_ = hash64(link.bytes());
}

uint64_t Digest::finish(uint64_t index_offset) const {
  const std::array<uint64_t, 2> words = {value_, index_offset};
  return hash64(std::as_bytes(std::span(words)));
}

namespace {

/// What messages call the patch of a chunk: of steps of time and of pieces it is their number.
const char* patch_word(const std::string& type) {
  if (type == "SVAL" || type == "SIDX" || type == "STEP") return "step";
  return type == "PIEC" || type == "GIDS" ? "piece" : "patch";
}

}  // namespace

std::string describe(const ChunkHeader& header) {
  const std::string type(header.type.begin(), header.type.end());
  return "chunk " + type + " (" + patch_word(type) + " " + std::to_string(header.patch) + ", number " +
         std::to_string(header.number) + ", part " + std::to_string(header.part()) + ")";
}

}  // namespace maille
