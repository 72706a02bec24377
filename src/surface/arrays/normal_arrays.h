#pragma once

#include <maille/error.h>

#include "surface/arrays/array_coder.h"

namespace maille {

// Arrays of normals that the surface tells: NormalCoder and FacetNormalCoder over a whole patch.

/// The first bytes of such streams.
inline constexpr uint8_t normal_coding = 8;
inline constexpr uint8_t facet_coding = 9;

/// Normals that a surface may predict.
bool is_normal(const PatchElements& elements, const Array& array);

/// As encode_array(), of an array for which is_normal() holds: tries what may fit on some elements, and codes
/// all with the smallest. Half-edges must have been built.
std::vector<std::byte> encode_normals(const PatchElements& elements, const Array& array,
                                      const ArrayMaps& maps, std::span<const uint32_t> source, Pace* pace);
/// Inverse. Safe on any bytes. Errors: corrupt, cancelled.
Result<> decode_normals(const PatchElements& elements, Bytes bytes, Array& array, Pace* pace);

}  // namespace maille
