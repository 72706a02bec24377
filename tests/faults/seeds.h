#pragma once

#include <vector>

#include "faults/mutations.h"

namespace maille::testing {

/// Golden files, and small random meshes at all levels.
std::vector<Seed> maille_seeds();

}  // namespace maille::testing
