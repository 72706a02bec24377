#pragma once

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>

namespace maille {

// encode(), decode() and inspect() for files of mode `random`.

Result<EncodeReport> encode_random(const Mesh& mesh, Sink& sink, const EncodeOptions& options);
Result<Mesh> decode_random(const Source& source, const DecodeOptions& options);
Result<FileInfo> inspect_random(const Source& source);

}  // namespace maille
