#pragma once

#include <maille/encode.h>
#include <maille/mesh_source.h>
#include <maille/stream.h>

namespace maille {

// What encode() of a mesh in parts needs before and after it, whichever way it is coded.

/// What a stream of the mesh is to hold. Errors: usage (such as an array that is not
/// there), unsupported (an array on corners).
Result<StreamOptions> stream_options_of(const MeshDescription& mesh, const EncodeOptions& options);
/// All that is known before it is coded: names and sizes.
EncodeReport report_of(const MeshDescription& mesh);

}  // namespace maille
