#pragma once

#include <cstdint>

namespace maille::tool {

/// What --memory is where nobody says: half of what the machine has, or its container may have, so that a
/// file of few bytes that decodes to a mesh without end is an error before the machine stands still.
uint64_t default_memory();

}  // namespace maille::tool
