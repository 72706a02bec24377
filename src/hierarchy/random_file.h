#pragma once

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>

#include "hierarchy/build_hierarchy.h"

namespace maille {

// encode(), decode() and inspect() for files of mode `random`.

/// Executor and progress of `hierarchy` are those of `options`.
Result<EncodeReport> encode_random(const Mesh& mesh, Sink& sink, const EncodeOptions& options,
                                   const HierarchyOptions& hierarchy = {});
Result<Mesh> decode_random(const Source& source, const DecodeOptions& options);
Result<FileInfo> inspect_random(const Source& source);

}  // namespace maille
