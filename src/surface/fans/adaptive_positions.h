#pragma once

#include <maille/error.h>
#include <maille/mesh.h>
#include <maille/source.h>

#include <cstdint>
#include <span>
#include <vector>

#include "numbers/number_map.h"
#include "surface/fans/fan_connectivity.h"

namespace maille {

struct PositionsStart;
class ByteReader;
class RansDecoder;
class RansEncoder;

/// Positions of the vertices of adaptive fans, vertex after vertex: weights follow the valences around,
/// residuals are coded with adaptive models in the context of what is left of neighbours and how far
/// predictions lie apart; where coordinates have few values, by these. docs/format.md, "POSI 2". For arrays
/// that fits_fan_positions() takes.
std::vector<std::byte> encode_adaptive_positions(const FanSurface& fans, const Array& array,
                                                 const ArrayMaps& maps, std::span<const uint32_t> source);

/// The same, of a sample of `all` positions: these count for what comes again.
std::vector<std::byte> encode_position_sample(const FanSurface& fans, const Array& array,
                                              const ArrayMaps& maps, std::span<const uint32_t> source,
                                              const Array& all);

/// Inverse: fills `array.bytes`, whose type is known, with `points` tuples. Safe on any bytes. `end`, if
/// given: what is known behind them.
Result<> decode_adaptive_positions(const FanSurface& fans, Bytes bytes, uint32_t points, Array& array,
                                   PositionsStart* end = nullptr);

/// What is known before positions: maps and coding, then with the coder of the rest what models have learnt.
/// The inverse is safe on any bytes: error corrupt.
std::vector<std::byte> write_positions_head(const PositionsStart& start);
Result<PositionsStart> read_positions_head(ByteReader& in, Scalar type);
void code_positions_start(RansEncoder& encoder, PositionsStart& start);
Result<> code_positions_start(RansDecoder& decoder, PositionsStart& start);

/// The same for positions of which something is known: maps, coding, and what models have learnt.
std::vector<std::byte> encode_adaptive_positions(const FanSurface& fans, const Array& array,
                                                 std::span<const uint32_t> source,
                                                 const PositionsStart& start);
Result<> decode_adaptive_positions(const FanSurface& fans, Bytes bytes, uint32_t points, Array& array,
                                   const PositionsStart& start);

}  // namespace maille
