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
#include "surface/parts/mesh_parts.h"
#include "surface/parts/shared_points.h"
#include "surface/patch_memory.h"
#include "surface/patch_streams.h"

namespace maille {

/// A chart as bytes: its sizes, which of its points other charts of level 0 have as well, and the streams of
/// a patch, as in mode `single`. docs/format.md, 17.3.

/// The arrays that charts of this level have; positions first.
std::vector<ArrayToCode> arrays_of_level(std::span<const ArrayToCode> arrays, uint32_t level);

/// What of a chart's cells its bytes need: the cells themselves can go once they are encoded.
struct ChartCounts {
  uint64_t points = 0;
  std::vector<BlockCells> cells;    ///< of the blocks that have some, rising
  std::optional<uint64_t> corners;  ///< where they do not follow from the cells
};
ChartCounts counts_of(const MeshPart& part);

/// The bytes of a chart. `blocks`: how many the mesh has, 1 at coarser levels; `shared`: at level 0 alone.
std::vector<std::byte> chart_bytes(const ChartCounts& counts, size_t blocks, const EncodedPatch& patch,
                                   std::optional<std::span<const SharedPoint>> shared);

struct DecodedChart {
  Mesh mesh;                            ///< with the blocks that have cells in the chart
  std::vector<uint32_t> block_numbers;  ///< by block: its place among those of the level, rising
  std::vector<SharedPoint> shared;      ///< by point, rising; not to show
};

/// What all charts of a level have; sizes, and which of the blocks, differ.
struct ChartSet {
  /// All arrays at level 0; at coarser ones those that do not belong to the mesh as a whole. No blocks.
  Description description;
  std::vector<CodedBlock> blocks;  ///< at level 0 those of the file; at coarser ones one, of triangles
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
