#pragma once

#include <cstdint>

namespace maille {

/// The number of no element: of a point, a corner, a half-edge, a tuple.
inline constexpr uint32_t none = 0xffffffff;

}  // namespace maille
