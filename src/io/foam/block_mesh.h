#pragma once

#include <maille/generate.h>

#include "io/foam/foam_dictionary.h"

namespace maille {

/// What a blockMeshDict that has been read says. Errors name file, line and entry.
Result<BlockDictionary> blocks_of(const FoamFile& file);

}  // namespace maille
