#pragma once

#include <cstdint>

namespace maille {

/// The number of no element: of a point, a corner, a half-edge, a tuple. It compares above all numbers; a
/// mesh has at most 2^32 - 2 points (max_points), so none of them has it.
inline constexpr uint32_t none = 0xffffffff;

}  // namespace maille
