#pragma once

#include "support/random.h"

#include <maille/mesh.h>

namespace maille::testing {

/// Overwrites some numbers by NaNs with payloads, infinities, -0, denormals, extreme integers.
void sprinkle_special_values(Array& array, Random& random, unsigned percent);

/// Up to eight arrays of any domain, scalar type and meaning, with values as files have them (smooth, few
/// different, constant, seams at corners, labels) and as they never should (random bits).
void add_random_arrays(Mesh& mesh, Random& random, bool special_values);

}  // namespace maille::testing
