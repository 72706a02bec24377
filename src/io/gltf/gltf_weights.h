#pragma once

#include <maille/mesh.h>

#include <string>
#include <vector>

// Weights of joints, which must still add up to 1 when they are rounded.

namespace maille {

/// The most bits for weights: a float has 24 for numbers below 1, and sums of several weights need some of
/// them.
inline constexpr int most_gltf_weight_bits = 20;

/// "weights", "weights_1", ...
bool is_gltf_weights(const std::string& name);

/// Rounds weights to multiples of 2^-bits. Those of a point, all arrays together, that add up to 1 do so
/// exactly afterwards; others go to the nearest multiple each. All arrays have as many tuples.
void round_gltf_weights(const std::vector<Array*>& arrays, int bits);

}  // namespace maille
