#pragma once

#include <maille/source.h>
#include <cstdint>
#include <span>
#include <vector>

#include "container/chunk_finder.h"
#include "container/stream_source.h"

// Small files of mode single, whose streams stand one after the other behind four bytes each. A scene in GLB
// has hundreds of meshes of some hundred bytes: headers and checksums of chunks were half of them.
// docs/format.md, "Packed files".

namespace maille {

/// Largest packed file: one read fetches it, so it needs no index either.
inline constexpr uint64_t most_packed_bytes = indexed_file_bytes;
/// Types that a packed file names by their place here: those of mode single without parts.
inline constexpr std::array<ChunkType, 6> packed_types = {{{'D', 'E', 'S', 'C'},
                                                           {'T', 'O', 'P', 'O'},
                                                           {'P', 'O', 'S', 'I'},
                                                           {'T', 'W', 'I', 'N'},
                                                           {'A', 'R', 'R', 'Y'},
                                                           {'O', 'R', 'D', 'R'}}};

/// What stands before the content of a stream; a check of both, hash16, is between them.
struct PackedEntry {
  /// The place in packed_types, plus eight times the stream's number: one byte up to number 15.
  uint32_t stream = 0;
  uint32_t size = 0;

  template <class Self, class Visitor>
  static void visit(Self& entry, Visitor& visitor) {
    visitor.count("stream", entry.stream, UINT32_MAX);
    visitor.count("size", entry.size, uint32_t{most_packed_bytes});
  }
};

struct NamedStream {
  StreamKey key;
  Bytes bytes;
};

/// A file of these streams: packed if it is of mode single, of one patch and small enough, otherwise in
/// chunks. Gives its size. Does not commit the sink.
Result<uint64_t> write_file(Sink& sink, FileHeader header, std::span<const NamedStream> streams);

/// The streams of a packed file whose checks are right, each as a chunk whose offset is that of its content.
/// The file is whole if there are no problems.
std::vector<ChunkRecord> find_packed(Bytes file, Problems& problems);

}  // namespace maille
