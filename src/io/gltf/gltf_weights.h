#pragma once

#include <maille/mesh.h>

#include <string>
#include <vector>

// Weights of joints, which must still add up to 1 when they are rounded.

namespace maille {

/// A float has no more for weights near 1.
inline constexpr int most_gltf_weight_bits = 20;

/// "weights", "weights_1", ...
bool is_gltf_weights(const std::string& name);

/// Weights in multiples of 2^-bits. Those of a point, all arrays together, that add up to 1 do so exactly
/// afterwards; others go to the nearest multiple each.
void round_gltf_weights(const std::vector<Array*>& arrays, int bits);

}  // namespace maille
