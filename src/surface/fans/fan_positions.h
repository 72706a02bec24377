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
/// docs/format.md, "Positions of fans".

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

// The same for many patches whose maps, rows and tables are written once: docs/format.md, "Tables of charts".

struct PatchOfPositions {
  const FanSurface* fans;
  std::span<const uint32_t> source;
};
struct SharedPositionBytes {
  std::vector<std::byte> tables;
  std::vector<std::vector<std::byte>> patches;
};
/// The same for any executor. There is a patch.
SharedPositionBytes encode_shared_positions(std::span<const PatchOfPositions> patches, const Array& array,
                                            const ArrayMaps& maps, bool small, Executor& executor);

/// Tables of some patches, with which any other is coded by itself: for patches that are not all there at
/// once.
class SampledPositions {
 public:
  virtual ~SampledPositions() = default;
  virtual const std::vector<std::byte>& tables() const = 0;
  /// None where the patch has what no patch of the sample had.
  virtual std::optional<std::vector<std::byte>> encode(const PatchOfPositions& patch,
                                                       const Array& array) const = 0;
};
/// `most_range`: codes of patches to come span at most so much, which in the narrow form must be below 65536;
/// there is a patch in the sample.
std::unique_ptr<SampledPositions> sample_positions(std::span<const PatchOfPositions> sample,
                                                   const Array& array, const ArrayMaps& maps, bool small,
                                                   uint64_t most_range, Executor& executor);

/// Ready for decoders; several may use it at once.
struct PositionTables;
/// `type`: of the positions. Safe on any bytes. Error: corrupt.
Result<std::shared_ptr<const PositionTables>> read_position_tables(Bytes bytes, Scalar type);
Result<> decode_shared_positions(FanDecoder& fans, Bytes bytes, const PositionTables& tables, uint32_t points,
                                 Array& array);

}  // namespace maille
