#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "surface/fans/fan_patch.h"
#include "surface/fans/fan_tables.h"
#include "surface/fans/positions.h"
#include "surface/patch_streams.h"

namespace maille {

/// Tables, rows, dictionaries and maps of many patches, made from a sample of them and written
/// once: patches of a few thousand faces would pay a tenth of their size for their own. docs/format.md,
/// 17.7.

/// Do these positions fit?
bool can_share_tables(const ArrayToCode& positions);

/// How far codes of these positions lie apart at most.
uint64_t range_of_codes(const ArrayToCode& positions);
/// So many patches make a sample (5bb20f3); no sweep is recorded. An earlier coder lost 0.05 % with 24
/// instead of 48, in a fraction of the time (ab0c4c3).
inline constexpr size_t most_sampled_patches = 64;

/// In this order: add() for patches of the sample, finish() once, then encode() for all patches.
class SharedFanEncoder {
 public:
  /// One of the sample; `array`: its positions, `points`: by point of the mesh, the tuple. The first one says
  /// whether tables are for polygons or for triangles; patches of the other kind are left out.
  Result<> add(const Mesh& mesh, const std::vector<uint32_t>& points, const Array& array);
  /// The tables; none where no patch had fans. `most_range`: see SharedPositions. `all`: the positions of all
  /// patches, if they are known: lossless numbers that come again are counted then.
  std::vector<std::byte> finish(const ArrayMaps& maps, int effort, uint64_t most_range,
                                const Array* all = nullptr);
  bool is_for_polygons() const { return coder_ && tables_.polygons; }
  /// After that: a patch for encode_patch(); several at once. None where it needs tables of its own.
  Result<std::optional<SharedFanPatch>> encode(const Mesh& mesh, const std::vector<uint32_t>& points,
                                               const ArrayToCode& positions) const;

 private:
  /// Ranks of numbers that come again, and coarse maps of doubles, by the positions of all patches.
  void consider_coarse(const Array& all, ArrayMaps maps, const Effort& effort);

  FanSurface sample_;  ///< vertices only
  Array positions_;    ///< of these
  FanCounts counts_;
  FanTables tables_;
  std::optional<SharedPositions> coder_;
};

/// Bytes of connectivity, positions and arrays, without what chunks add.
uint64_t size_of_patch(const EncodedPatch& patch);

/// encode_patch() for a chart: with shared tables, or where mixing takes less, with that.
Result<EncodedPatch> encode_chart(const Mesh& mesh, const PartNumbers& numbers,
                                  std::span<const ArrayToCode> arrays, const EncodeOptions& options,
                                  const SharedFanEncoder& shared);

/// The tables ready for decoders; several may use them at once.
struct SharedFanTables {
  std::shared_ptr<const FanSlots> fans;
  std::shared_ptr<const PositionTables> positions;

  /// `type`: of the positions. Safe on any bytes. Error: corrupt.
  static Result<SharedFanTables> read(Bytes bytes, Scalar type);
};

}  // namespace maille
