#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

#include "base/pace.h"
#include "numbers/number_map.h"
#include "surface/arrays/array_coder.h"

namespace maille {

/// Stands where other arrays have their predictor.
inline constexpr uint8_t mixed_coding = 16;

/// Are the steps of all maps of a size with which geometry can be done? Else arrays are coded as numbers.
template <class Code>
bool can_mix(Scalar type, std::span<const NumberMap> maps, std::span<const Code> codes);

/// Codes the points' numbers, three each in coded order, by MixedPositionCoder: its settings, then what it
/// writes. `codes` keep their values. `pace` may stop it: then the bytes are of no use.
template <class Code>
std::vector<std::byte> encode_mixed(const PatchElements& elements, Scalar type,
                                    std::span<const NumberMap> maps, std::span<Code> codes, Pace* pace);

/// Inverse: fills `codes`, three for each point. Safe on any bytes. Errors: corrupt, cancelled.
template <class Code>
Result<> decode_mixed(const PatchElements& elements, Scalar type, std::span<const NumberMap> maps,
                      Bytes bytes, std::span<Code> codes, Pace* pace);

}  // namespace maille
