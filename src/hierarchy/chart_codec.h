#pragma once

#include <maille/decode.h>
#include <maille/encode.h>

#include <span>
#include <vector>

#include "surface/description.h"
#include "surface/patch_streams.h"

namespace maille {

/// A chart as bytes: its sizes, which of its points other charts of level 0 have as well, and the streams of
/// a patch, as in mode `single`. docs/format.md, 13.3.

/// A point that several charts have. Those of one position are told apart by the number of the copy, nearly
/// always 0.
struct SharedPoint {
  uint32_t point = 0;  ///< in the chart
  uint32_t copy = 0;
};

/// What a chart of this level is described by: all blocks and arrays at level 0; one block of triangles and
/// the arrays of points at coarser levels. Without sizes.
Description chart_description(const Description& file, uint32_t level);
/// The arrays that charts of this level have; positions first.
std::vector<ArrayToCode> arrays_of_level(std::span<const ArrayToCode> arrays, uint32_t level);

/// The bytes of a chart. `part` are the cells that were encoded, with the number of points; `shared` is empty
/// at coarser levels.
std::vector<std::byte> chart_bytes(const Mesh& part, const EncodedPatch& patch,
                                   std::span<const SharedPoint> shared);

struct DecodedChart {
  Mesh mesh;
  std::vector<SharedPoint> shared;  ///< by point, rising
};

/// What the chart says it takes in memory. Error: corrupt.
Result<double> claimed_bytes(const Description& described, Bytes bytes);

/// Inverse; `described` is chart_description() of its level. Safe on any bytes. Errors: corrupt,
/// memory_bound, cancelled.
Result<DecodedChart> decode_chart(const Description& described, Bytes bytes, const DecodeOptions& options);

}  // namespace maille
