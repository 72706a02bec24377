#pragma once

#include <maille/mesh_source.h>

#include "volume/stream/mesh_stream.h"

namespace maille {

/// Maps as choose_stream_maps() finds them, by a look at some ten thousand numbers of each array, and at all
/// where a bound needs the range; with `mixes_values` then those of TableSearch. A number that does not fit
/// is kept all the same, as an exception, and costs more. Small arrays are read whole, so that a mesh in
/// parts gives the same bytes as one in memory then.
Result<ArrayMapsList> choose_source_maps(MeshSource& mesh, const StreamOptions& options,
                                         std::optional<bool> mixes_values);

}  // namespace maille
