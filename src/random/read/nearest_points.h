#pragma once

#include <maille/random_access.h>

#include <vector>

#include "random/read/random_reader.h"

namespace maille {

/// What File::nearest_points() says.
Result<std::vector<NearPoint>> nearest_points(RandomReader& reader, const Vector3& point, uint64_t count);

}  // namespace maille
