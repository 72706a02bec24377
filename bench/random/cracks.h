#pragma once

#include <maille/error.h>

#include <string>

namespace maille {

/// Looks at a file of mode random from `views` random places, by error and by budget, and counts edges that
/// are open in what is drawn and not in the mesh. Prints one line. Returns how many there were.
Result<uint64_t> count_cracks(const std::string& path, uint32_t views);

}  // namespace maille
