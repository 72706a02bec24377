#pragma once

#include <maille/generate.h>
#include <string>

#include "io/foam/foam_dictionary.h"

namespace maille {

/// Three numbers in parentheses.
Result<Position> read_foam_position(FoamCursor& at);

/// A surface of a blockMeshDict's `geometry`: sphere, cylinder, plane, box, plate, or the file of a
/// triSurfaceMesh, which is looked for in constant/triSurface and constant/geometry of the case that the
/// dictionary lies in. Errors: malformed_input, unsupported, with file and line; those of reading the file.
Result<BlockSurface> read_foam_surface(const FoamFile& file, const FoamDictionary::Entry& entry,
                                       const std::string& name, const Limits& limits);

}  // namespace maille
