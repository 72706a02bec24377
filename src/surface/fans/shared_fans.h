#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "surface/fans/fan_patch.h"
#include "surface/fans/fan_positions.h"
#include "surface/fans/fan_tables.h"
#include "surface/patch_streams.h"

namespace maille {

/// Tables, rows and maps of many patches of triangles, made for all of them and written once: patches of a
/// few thousand faces would pay a tenth of their size for their own. docs/format.md, "Tables of charts".

/// Does this effort have static tables, and do these positions fit?
bool can_share_tables(const ArrayToCode& positions, int effort);

/// Patches on their way: the fans of each are found alone, the rest is known when all are there.
class SharedFanEncoder {
 public:
  /// `positions` must stay.
  SharedFanEncoder(size_t patches, const ArrayToCode& positions, const EncodeOptions& options);
  /// Several at once may be found. Faces of more than three corners: not shared, which is no error.
  Result<> find(size_t patch, const Mesh& mesh, const std::vector<uint32_t>& points_in_whole);
  /// The tables, when all are found; none where no patch has fans.
  std::vector<std::byte> finish(Executor& executor);
  /// After that: a patch for encode_patch().
  std::optional<SharedFanPatch> take(size_t patch) { return std::move(patches_[patch]); }

 private:
  const ArrayToCode& positions_;
  const EncodeOptions& options_;
  std::vector<std::optional<SharedFanPatch>> patches_;
  std::vector<std::vector<uint32_t>> points_;  ///< by patch and coded point: the point in the whole mesh
};

/// The same for patches that are not all there at once: tables of a sample, with which any patch is coded by
/// itself.
class SampledFanEncoder {
 public:
  /// One of the sample; `array`: its positions, `points`: by point of the mesh, the tuple. Patches of other
  /// faces than triangles are left out.
  Result<> add(const Mesh& mesh, const std::vector<uint32_t>& points, const Array& array);
  /// The tables; none where no patch had fans. `most_range`: see sample_positions().
  std::vector<std::byte> finish(const ArrayMaps& maps, int effort, uint64_t most_range, Executor& executor);
  /// After that: a patch for encode_patch(); several at once. None where it needs tables of its own.
  Result<std::optional<SharedFanPatch>> encode(const Mesh& mesh, const std::vector<uint32_t>& points,
                                               const Array& array) const;

 private:
  Array positions_;  ///< of the sample
  std::vector<EncodedFanPatch> sample_;
  std::vector<std::vector<uint32_t>> sources_;
  FanTables tables_;
  std::unique_ptr<SampledPositions> coder_;
};

/// The tables ready for decoders; several may use them at once.
struct AdaptiveStart;
struct SharedFanTables {
  std::shared_ptr<const FanSlots> fans;
  std::shared_ptr<const PositionTables> positions;
  std::shared_ptr<const AdaptiveStart> start;  ///< instead of both, with adaptive models

  /// `type`: of the positions. Safe on any bytes. Error: corrupt.
  static Result<SharedFanTables> read(Bytes bytes, Scalar type);
};

}  // namespace maille
