#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surface/patch_topology.h"
#include "surface/vector3.h"

namespace maille {

// Which corners of a welded patch have the same twin (weld.h): pair by pair around each vertex, then for each
// run of them whether the twin came up at its point before. docs/format.md, 13.7.

/// `twin_of`: by corner as in PatchElements, any number that corners of one twin share. `positions`: as
/// decoded. Replaces the numbers by those that the decoder will have: point by point, at each of them as they
/// come up.
std::vector<std::byte> encode_twins(const PatchTopology& topology, std::span<const Vector3> positions,
                                    std::vector<uint32_t>& twin_of);

/// Inverse: the number of each corner as in PatchElements, 0 in gaps; all numbers are below that of corners.
/// Safe on any bytes. Error: corrupt.
Result<std::vector<uint32_t>> decode_twins(const PatchTopology& topology, std::span<const Vector3> positions,
                                           Bytes bytes);

}  // namespace maille
