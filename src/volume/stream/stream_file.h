#pragma once

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>
#include <maille/out_of_core.h>
#include <maille/stream.h>

#include <optional>

#include "base/result.h"
#include "description/description.h"
#include "volume/order/mesh_order.h"
#include "volume/stream/mesh_stream.h"
#include "volume/stream/stream_layout.h"

namespace maille {

class FileReader;

// encode(), decode() and inspect() for files of mode `stream`: a mesh in memory goes through StreamWriter and
// StreamReader. Errors are those of encode() and decode().

/// Checks the mesh, chooses maps and order, and writes the file. Errors: malformed_input (the mesh breaks its
/// rules), usage, unsupported, cancelled, those of the sink.
Result<EncodeReport> encode_stream(const Mesh& mesh, Sink& sink, const EncodeOptions& options);
/// The same of a mesh that is read in parts, within space.limit. Error too: memory_bound, told before
/// anything is written.
Result<EncodeReport> encode_stream(MeshSource& mesh, Sink& sink, const EncodeOptions& options,
                                   const WorkingSpace& space);
/// The whole mesh, in the input's order where that was kept. Errors: corrupt, unsupported, memory_bound,
/// cancelled, those of the source.
Result<Mesh> decode_stream(const Source& source, const DecodeOptions& options);
/// decode() into a mesh that is written in parts.
Result<> decode_stream(const Source& source, MeshSink& sink, const DecodeOptions& options);
/// What can be read before the first damage, as a valid mesh.
Result<Salvaged> salvage_stream(const Source& source, const DecodeOptions& options);
/// Where the input's points and cells stand in the stream; none where the stream has them in the input's
/// order, or in any.
Result<std::optional<InputOrder>> input_order_of(const Source& source, const Limits& limits);
/// From description, end and index; no cell is decoded.
Result<FileInfo> inspect_stream(const Source& source, const Limits& limits);
/// What description and end tell; sizes of what is coded are not among it.
FileInfo info_of_stream(const Source& source, const FileReader& reader, const StreamHeader& header,
                        const StreamTail& tail);
/// What is damaged in them is told as a problem.
Result<> add_steps(const FileReader& file, const StreamHeader& header, const Limits& limits, FileInfo& info);

/// What a stream of the mesh is to hold, by what encode() is told. Errors: usage (such as an array that is
/// not there), unsupported (an array on corners).
Result<StreamOptions> stream_options_of(const Mesh& mesh, const EncodeOptions& options);
/// A valid mesh with maps that were chosen before, and its points in the order in which decoders number them,
/// if that is asked for.
Result<EncodeReport> encode_stream_by(const Mesh& mesh, Sink& sink, const EncodeOptions& options,
                                      StreamOptions stream, ArrayMapsList maps,
                                      std::vector<uint32_t>* coded_points = nullptr);

/// Adds what encode() is told and a stream takes as it is, of a mesh in memory or in parts, and checks all of
/// it: here, as a file in pieces may have no stream whose writer would.
template <class AnyMesh>
Result<StreamOptions> complete_options(const AnyMesh& mesh, const EncodeOptions& options,
                                       StreamOptions stream) {
  stream.metadata = mesh.metadata;
  stream.provenance = options.provenance;
  stream.effort = options.effort;
  stream.time = options.time;
  stream.any_order = options.order == Order::canonical;
  stream.executor = options.executor;
  MAILLE_CHECK(check_stream_options(stream));
  return stream;
}

/// What a stream says before its first and after its last cell. Error: corrupt when either is missing,
/// unsupported for other modes.
struct StreamEnds {
  StreamHeader header;
  StreamTail tail;
  bool in_pieces = false;
};
Result<StreamEnds> read_stream_ends(const Source& source, const Limits& limits);

}  // namespace maille
