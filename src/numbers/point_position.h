#pragma once

#include <maille/geometry.h>
#include <maille/mesh.h>

namespace maille {

/// A point's position, whatever the type of its three numbers. Numbers that are not finite stay so.
/// Not inline: a switch over ten types in each of its callers would cost the web decoder kilobytes.
Vector3 point_position(Scalar type, const std::byte* positions, uint64_t point);

inline Vector3 point_position(const Array& positions, uint64_t point) {
  return point_position(positions.type, positions.bytes.data(), point);
}

}  // namespace maille
