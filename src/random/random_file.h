#pragma once

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>
#include <maille/out_of_core.h>

#include "description/remains.h"
#include "random/build/build_hierarchy.h"
#include "random/build/level_builder.h"

namespace maille {

// encode(), decode() and inspect() for files of mode `random`.

/// Executor and progress of `hierarchy` are those of `options`.
Result<EncodeReport> encode_random(const Mesh& mesh, Sink& sink, const EncodeOptions& options,
                                   const HierarchyOptions& hierarchy = {});
/// How a mesh that is read in parts is built. The file depends on sizes and window_faces, not on memory.
struct SourceBuilding {
  ChartSizes sizes;
  uint64_t window_faces = uint64_t{1} << 19;
  WorkingSpace space;
};
/// The same for a mesh that is read in parts. Errors: also those of the source.
Result<EncodeReport> encode_random(MeshSource& mesh, Sink& sink, const EncodeOptions& options,
                                   const SourceBuilding& building = {});
Result<Mesh> decode_random(const Source& source, const DecodeOptions& options);
/// What is left of a damaged one: the charts whose checksums fit. Error: corrupt, if that is nothing.
Result<Remains> salvage_random(const Source& source, const DecodeOptions& options);
Result<FileInfo> inspect_random(const Source& source, const Limits& limits);

}  // namespace maille
