#pragma once

#include "base/bytes.h"
#include "mesh/number_map.h"

namespace maille {

/// A number map as streams of arrays have it.
void write_map(ByteWriter& out, const NumberMap& map);
/// Inverse. Error: corrupt, for a map that choose_maps() cannot make for this type.
Result<NumberMap> read_map(ByteReader& in, Scalar type);

}  // namespace maille
