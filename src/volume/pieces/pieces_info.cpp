#include "base/result.h"
#include "volume/pieces/piece_reader.h"
#include "volume/pieces/pieces_file.h"

namespace maille {

/// From index and end alone. Error: as PieceReader::open().
Result<FileInfo> inspect_pieces(const Source& source, const Limits& limits) {
  DecodeOptions options;
  options.limits = limits;
  const PieceReader reader = MAILLE_TRY(PieceReader::open(source, options));
  FileInfo info = info_of_stream(source, reader.file(), reader.header(), reader.tail());
  for (const PieceRecord& piece : reader.pieces()) {
    // The order counts as connectivity here, as it does in a stream whose order stands apart.
    info.connectivity.coded_bytes += piece.coded_bytes[0] + piece.coded_bytes[1];
    info.positions.coded_bytes += piece.coded_bytes[2];
    for (size_t i = 0; i < info.arrays.size(); ++i) info.arrays[i].coded_bytes += piece.coded_bytes[i + 3];
  }
  for (const ChunkInfo& chunk : info.chunks) {
    if (chunk.type == "GIDS") info.connectivity.coded_bytes += chunk.size;
  }
  MAILLE_CHECK(add_steps(reader.file(), reader.header(), limits, info));
  return info;
}

}  // namespace maille
