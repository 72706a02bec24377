#pragma once

#include <maille/decode.h>
#include <maille/encode.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "description/description.h"
#include "surface/fans/shared_fans.h"
#include "surface/parts/shared_points.h"
#include "surface/patch_memory.h"
#include "surface/patch_streams.h"

namespace maille {

/// A chart as bytes: its sizes, which of its points other charts of level 0 have as well, and the streams of
/// a patch, as in mode `single`. docs/format.md, 17.3.

/// What a chart of this level is described by: all blocks and arrays at level 0; one block of triangles, and
/// no arrays of the mesh as a whole, at coarser levels. Without sizes.
Description chart_description(const Description& file, uint32_t level);
/// The arrays that charts of this level have; positions first.
std::vector<ArrayToCode> arrays_of_level(std::span<const ArrayToCode> arrays, uint32_t level);

/// The bytes of a chart. `part` are the cells that were encoded, with the number of points; `shared`: at
/// level 0 alone.
std::vector<std::byte> chart_bytes(const Mesh& part, const EncodedPatch& patch,
                                   std::optional<std::span<const SharedPoint>> shared);

struct DecodedChart {
  Mesh mesh;
  std::vector<SharedPoint> shared;  ///< by point, rising; not to show
};

/// What all charts of a level have: what a description leaves open differs.
struct ChartSet {
  Description description;  ///< chart_description() of the level
  bool finest = false;
  SharedFanTables tables;  ///< empty where charts have their own
};
/// The charts of level 0, and those of all others, have tables of their own: docs/format.md, 17.7.
inline constexpr uint32_t chart_sets = 2;
using ChartSets = std::array<ChartSet, chart_sets>;
inline uint32_t set_of_level(uint32_t level) {
  return std::min(level, chart_sets - 1);
}

/// `tables`: none, or the bytes of a stream CTAB. Safe on any bytes. Error: corrupt.
Result<ChartSet> chart_set(const Description& file, uint32_t set, Bytes tables);

/// What the chart says it takes in memory, with its bytes, is added to `memory`. Error: corrupt.
Result<> add_claimed_memory(const ChartSet& set, Bytes bytes, PatchesMemory& memory);

/// To join charts of level 0, one must know which points they share: a tenth of the time.
enum class ChartUse : uint8_t { join, show };

/// Inverse. `buffers`: for many one after the other. Safe on any bytes. Errors: corrupt, memory_bound,
/// cancelled.
Result<DecodedChart> decode_chart(const ChartSet& set, Bytes bytes, const DecodeOptions& options,
                                  FanBuffers* buffers = nullptr, ChartUse use = ChartUse::join);

}  // namespace maille
