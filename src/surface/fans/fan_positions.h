#pragma once

#include <maille/error.h>
#include <maille/executor.h>
#include <maille/mesh.h>
#include <maille/source.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "numbers/number_map.h"
#include "surface/fans/fan_connectivity.h"

namespace maille {

/// Positions of the vertices of fans, for decoding near memory speed: every prediction is a row of eight
/// weights over the vertex's references; what is left goes into classes with static tables, and raw bits.
/// docs/format.md, "POSI 2".

/// Are these maps something that the fast coder takes: three codes of 32 bits, nothing left over?
bool fits_fan_positions(const Array& array, const ArrayMaps& maps);

/// Codes the positions of `source.size()` points: those of the fans by vertex, then others, each by its tuple
/// in the array. `small`: with late triples, and with a choice of predictions for each vertex where that
/// pays; takes twice the time here, and up to a third more in the decoder.
std::vector<std::byte> encode_fan_positions(const FanSurface& fans, const Array& array, const ArrayMaps& maps,
                                            std::span<const uint32_t> source, bool small = true);

/// Inverse: fills `array.bytes`, whose type is known, with `points` tuples, and decodes the fans as far as
/// positions need them. Safe on any bytes.
Result<> decode_fan_positions(FanDecoder& fans, Bytes bytes, uint32_t points, Array& array);

}  // namespace maille
