#pragma once

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>

#include "description/remains.h"

namespace maille {

// encode(), decode() and inspect() for files of mode `single`.

Result<EncodeReport> encode_single(const Mesh& mesh, Sink& sink, const EncodeOptions& options);
Result<Mesh> decode_single(const Source& source, const DecodeOptions& options);
/// What is left of a damaged one. Error: corrupt, if that is nothing.
Result<Remains> salvage_single(const Source& source, const DecodeOptions& options);
Result<FileInfo> inspect_single(const Source& source, const Limits& limits);

}  // namespace maille
