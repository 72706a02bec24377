#pragma once

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>

#include "volume/stream_layout.h"

namespace maille {

// encode(), decode() and inspect() for files of mode `stream`: a mesh in memory goes through StreamWriter and
// StreamReader.

Result<EncodeReport> encode_stream(const Mesh& mesh, Sink& sink, const EncodeOptions& options);
Result<Mesh> decode_stream(const Source& source, const DecodeOptions& options);
Result<FileInfo> inspect_stream(const Source& source);

/// What a stream says before its first and after its last cell. Error: corrupt when either is missing.
struct StreamEnds {
  StreamHeader header;
  StreamTail tail;
};
Result<StreamEnds> read_stream_ends(const Source& source);

}  // namespace maille
