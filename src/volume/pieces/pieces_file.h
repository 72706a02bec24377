#pragma once

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>

#include "volume/pieces/piece_layout.h"
#include "volume/stream/stream_file.h"

namespace maille {

// Files of mode stream whose cells are divided into pieces of space, each a stream of its own: any of them
// can be read alone, all at once, and damage costs one. encode(), decode() and inspect() for them.
// docs/format.md, "Pieces".

/// Pieces of about `target` cells. Errors as encode().
Result<EncodeReport> encode_in_pieces(const Mesh& mesh, Sink& sink, const EncodeOptions& options,
                                      uint64_t target);
Result<Mesh> decode_pieces(const Source& source, const DecodeOptions& options);
/// All pieces that are whole.
Result<Salvaged> salvage_pieces(const Source& source, const DecodeOptions& options);
Result<FileInfo> inspect_pieces(const Source& source);

}  // namespace maille
