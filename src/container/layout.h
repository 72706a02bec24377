#pragma once

#include <maille/encode.h>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "base/bytes.h"
#include "container/fields.h"

// The bytes of a .maille file as docs/format.md, 3 to 6, describes them: header, chunks, footer.

namespace maille {

inline constexpr std::array<uint8_t, 8> file_magic = {0x89, 'M', 'A', 'I', '\r', '\n', 0x1a, '\n'};
inline constexpr std::array<uint8_t, 2> chunk_marker = {0xa5, 'M'};
inline constexpr std::array<uint8_t, 4> end_magic = {0x89, 'E', 'N', 'D'};
inline constexpr ChunkType index_type = {'I', 'N', 'D', 'X'};

/// Largest content of a chunk. It bounds what a reader allocates before it has seen a checksum.
inline constexpr uint32_t max_chunk_bytes = uint32_t{1} << 20;
/// Files whose chunks end before this byte carry no index: one read fetches them whole.
inline constexpr uint64_t indexed_file_bytes = uint64_t{64} << 10;

inline constexpr size_t file_header_bytes = 25;
inline constexpr size_t chunk_checksum_bytes = 8;
inline constexpr size_t footer_bytes = 20;
/// Marker, type, four counts (5 + 5 + 5 + 3 bytes), header check.
inline constexpr size_t max_chunk_header_bytes = 2 + 4 + 18 + 2;

/// A volume in pieces (src/volume/pieces).
inline constexpr uint32_t in_pieces_feature = 1;
/// Streams without chunks (packed_file.h).
inline constexpr uint32_t packed_feature = 2;
/// Features this version knows.
inline constexpr uint32_t known_required_features = in_pieces_feature | packed_feature;

/// What the first bytes of a file say. docs/format.md, 3.
struct FileHeader {
  uint16_t major = 0;
  uint16_t minor = 0;
  uint32_t required_features = 0;  ///< an unknown bit: the reader refuses the file
  uint32_t optional_features = 0;  ///< an unknown bit: ignored
  Mode mode = Mode::single;

  template <class Self, class Visitor>
  static void visit(Self& header, Visitor& visitor) {
    visitor.fixed("major", header.major);
    visitor.fixed("minor", header.minor);
    visitor.fixed("required_features", header.required_features);
    visitor.fixed("optional_features", header.optional_features);
    visitor.fixed("mode", header.mode);
  }
};

/// What stands before the content of a chunk; also one entry of the index.
struct ChunkHeader {
  ChunkType type = {};
  uint32_t patch = 0;
  uint32_t number = 0;
  uint32_t part_and_last = 0;  ///< twice the part's number, plus one for the last part of a stream
  uint32_t size = 0;           ///< bytes of content

  uint32_t part() const { return part_and_last / 2; }
  bool last() const { return part_and_last % 2 != 0; }

  template <class Self, class Visitor>
  static void visit(Self& header, Visitor& visitor) {
    visitor.letters("type", header.type);
    visitor.count("patch", header.patch, UINT32_MAX);
    visitor.count("number", header.number, UINT32_MAX);
    visitor.count("part", header.part_and_last, UINT32_MAX);
    visitor.count("size", header.size, max_chunk_bytes);
  }
};

/// Where a chunk stands, and the checksum at its end.
struct ChunkRecord {
  ChunkHeader header;
  uint64_t offset = 0;  ///< of its marker
  uint64_t checksum = 0;
};

struct Footer {
  uint64_t index_offset = 0;  ///< of the first index chunk; 0: no index
  uint64_t digest = 0;

  template <class Self, class Visitor>
  static void visit(Self& footer, Visitor& visitor) {
    visitor.fixed("index_offset", footer.index_offset);
    visitor.fixed("digest", footer.digest);
  }
};

/// All 25 bytes, checksum included.
std::vector<std::byte> write_file_header(const FileHeader& header);
/// Error: corrupt (not a .maille file, damaged, too short), unsupported (another version). `name` opens the
/// message.
Result<FileHeader> read_file_header(Bytes first_bytes, const std::string& name);

/// Marker, fields, header check.
std::vector<std::byte> write_chunk_header(const ChunkHeader& header);
/// A chunk header at the front of `bytes` (max_chunk_header_bytes of them, or what is left of the file), and
/// its size. Nothing when there is none, or a damaged one.
struct ParsedChunkHeader {
  ChunkHeader header;
  size_t header_bytes = 0;
  uint64_t total_bytes() const { return header_bytes + uint64_t{header.size} + chunk_checksum_bytes; }
};
std::optional<ParsedChunkHeader> read_chunk_header(Bytes bytes);
/// Bytes of a whole chunk: header, content, checksum.
uint64_t chunk_total_bytes(const ChunkHeader& header);
/// The content of the chunk that fills `bytes`. Nothing when its header differs from `record`'s or its
/// checksum does not fit.
std::optional<Bytes> chunk_content(Bytes bytes, const ChunkRecord& record);

std::vector<std::byte> write_footer(const Footer& footer);
/// Nothing when the end magic is missing.
std::optional<Footer> read_footer(Bytes last_bytes);

/// Hash over the file's header, the header and checksum of each chunk in order, and the place of the index:
/// binds the parts of one file together, so that none can be lost, exchanged or taken from another file
/// unnoticed.
class Digest {
 public:
  explicit Digest(Bytes file_header);
  void add_chunk(const ChunkHeader& header, uint64_t checksum);
  uint64_t finish(uint64_t index_offset) const;

 private:
  uint64_t value_;
};

/// Compares a stored checksum with the computed one. Always true in builds for fuzzing, so that mutated
/// files get past it.
inline bool checksum_matches(uint64_t stored, uint64_t computed) {
#ifdef MAILLE_FUZZING
  static_cast<void>(stored);
  static_cast<void>(computed);
  return true;
#else
  return stored == computed;
#endif
}

/// "chunk POSN (patch 2, number 0, part 1)"
std::string describe(const ChunkHeader& header);

}  // namespace maille
