#pragma once

#include <maille/generate.h>

#include "io/foam/foam_dictionary.h"

namespace maille {

/// What a blockMeshDict that has been read says. `limits`: of each file with triangles that it names. Errors
/// name file, line and entry.
Result<BlockDictionary> blocks_of(const FoamFile& file, const Limits& limits = {});

}  // namespace maille
