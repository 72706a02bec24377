#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "surface/fans/shared_fans.h"
#include "surface/patch_streams.h"

namespace maille {

class AdaptiveFanModel;

/// What the adaptive models of fans and positions know before a patch: about what they learnt from a sample
/// of the patches of a file. Patches of a few thousand faces would pay a twentieth of their size for learning
/// it each by itself. docs/format.md, "Start of charts".
struct AdaptiveStart;

/// Do adaptive models of this effort begin with a sample, and do these positions fit?
bool can_share_start(const ArrayToCode& positions, int effort);
/// How many of so many patches are the sample. What they teach takes some kilobytes, however many they are.
size_t charts_in_start(size_t charts);
/// How many others are coded with and without it, to see what it saves.
inline constexpr size_t probes_of_start = 4;

/// Patches of triangles that are to be the sample, and others that tell whether it saves more than it takes:
/// where each patch has maps or repeats of its own, it does not.
class StartSample {
 public:
  /// `array`: its positions, `points`: by point of the mesh, the tuple. Patches that fans are not made for
  /// are left out.
  Result<> add(const Mesh& mesh, const std::vector<uint32_t>& points, const Array& array);
  Result<> add_probe(const Mesh& mesh, const std::vector<uint32_t>& points, const Array& array);
  /// Of all patches, or a good part of them.
  struct Positions {
    const Array& array;
    bool complete;
  };
  /// What was learnt as it stands in the file; nothing where it does not pay for so many faces. `maps` hold
  /// for all patches.
  Result<std::vector<std::byte>> finish(const ArrayMaps& maps, const Positions& positions, uint64_t faces,
                                        int effort);

 private:
  Result<std::vector<std::byte>> write(const EncodedFanPatch& coded, const ArrayMaps& maps,
                                       const Array& all) const;
  /// About the bytes of so many faces, by what the probes take. `start`: none: nullptr.
  Result<double> size_of_all(const ArrayMaps& maps, const AdaptiveStart* start, uint64_t faces,
                             int effort) const;

  Mesh mesh_;
  std::vector<Mesh> probes_;
};

/// Inverse. `type`: of the positions. Safe on any bytes. Error: corrupt.
Result<std::shared_ptr<const AdaptiveStart>> read_start(Bytes bytes, Scalar type);

/// encode_patch() with these models, where fans are made for the patch. At efforts that mix, what takes less:
/// mixing learns more from a patch, but begins anew with each.
Result<EncodedPatch> encode_patch_from_start(const Mesh& mesh, const PartNumbers& numbers, uint32_t patch,
                                             std::span<const ArrayToCode> arrays,
                                             const EncodeOptions& options, const AdaptiveStart& start);
/// Inverses, as those without it.
Result<FanPatchDecoder> begin_fan_patch(Bytes bytes, uint32_t points, uint64_t corners,
                                        const AdaptiveStart& start);
Result<> decode_adaptive_positions(const FanSurface& fans, Bytes bytes, uint32_t points, Array& array,
                                   const AdaptiveStart& start);

// Connectivity with models that know something already (`start`, none: nullptr), and what they know behind
// it.
EncodedFans encode_fans(const HalfEdges& surface, uint32_t real_half_edges, uint32_t point_count,
                        FanModels models, const AdaptiveFanModel* start);
Result<std::optional<EncodedFanPatch>> encode_fan_patch(const Mesh& mesh, FanModels models,
                                                        const AdaptiveFanModel* start);
Result<FanSurface> decode_adaptive_fans(Bytes bytes, uint32_t triangles, uint32_t most_vertices,
                                        const AdaptiveFanModel* start, AdaptiveFanModel* end);

}  // namespace maille
