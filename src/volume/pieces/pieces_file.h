#pragma once

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>

#include "volume/pieces/piece_layout.h"
#include "volume/stream/stream_file.h"

namespace maille {

// Files of mode stream whose cells are divided into pieces of space, each a stream of its own: any of them
// can be read alone, all at once, and damage costs one. encode(), decode() and inspect() for them.
// docs/format.md, 16.14.

/// Pieces of about `target` cells. Errors as encode().
Result<EncodeReport> encode_in_pieces(const Mesh& mesh, Sink& sink, const EncodeOptions& options,
                                      uint64_t target);
/// The same of a mesh that is read in parts, and the same bytes as for it in memory, where it has no more
/// than two million cells and no two points that pieces share are in one place; of larger ones cuts are found
/// by a sample. Memory: `space`, and some hundred bytes for each cell of the pieces that are coded at once.
Result<EncodeReport> encode_in_pieces(MeshSource& mesh, Sink& sink, const EncodeOptions& options,
                                      uint64_t target, const WorkingSpace& space);
/// The whole mesh in memory, pieces side by side. Errors as decode().
Result<Mesh> decode_pieces(const Source& source, const DecodeOptions& options);
/// Into a mesh that is written in parts, piece after piece; cells that do not come in its order go through a
/// temporary file. Decoded values are held against the index, too: where it is wrong, queries miss cells.
Result<> decode_pieces(const Source& source, MeshSink& sink, const DecodeOptions& options,
                       const WorkingSpace& space);
/// All pieces that are whole.
Result<Salvaged> salvage_pieces(const Source& source, const DecodeOptions& options);
/// From description, index and end. Errors as inspect().
Result<FileInfo> inspect_pieces(const Source& source, const Limits& limits);

}  // namespace maille
