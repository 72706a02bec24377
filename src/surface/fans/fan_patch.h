#pragma once

#include <optional>

#include "base/bytes.h"
#include "surface/fans/fan_connectivity.h"
#include "surface/patch_topology.h"

namespace maille {

struct FanTables;

/// A patch at the fast and default levels: TOPO 1 (triangles), 2 (polygons) and 3 (either, with shared
/// tables), docs/format.md.
struct FanPatch {
  /// In the mesh's orientation; faces that lie more than once follow behind all others.
  FanSurface fans;
  /// Blocks of faces, loose cells and number of points. The surface in it is not built, only counted.
  PatchTopology topology;
};

/// What encode_fan_patch() gives; `sources` tell where the coded elements are in the mesh.
struct EncodedFanPatch {
  FanPatch patch;
  PatchSources sources;
  std::vector<std::byte> bytes;  ///< where tables are shared: what stands beside the fans
  std::vector<FanOperation> operations;
};

/// The bytes of a patch with shared tables; these have been made with its operations.
std::vector<std::byte> write_shared_fan_patch(const EncodedFanPatch& coded, const FanTables& tables);

/// Codes the cells of a mesh. No value when there are more points than fans can number; the front takes such
/// meshes. Error: unsupported, for too many corners.
Result<std::optional<EncodedFanPatch>> encode_fan_patch(const Mesh& mesh,
                                                        FanModels models = FanModels::fixed);

/// Inverse, in two steps: begin() reads heads and sections, then positions can be decoded along with `fans`,
/// then finish() decodes what is left. Safe on any bytes. The bytes must stay until finish() has returned.
struct FanPatchDecoder {
  std::optional<FanDecoder> fans;

  /// `bytes` must stay. Error: corrupt.
  static Result<FanPatchDecoder> begin(Bytes bytes, uint32_t points, uint64_t corners);
  /// The same for polygons, all of which are decoded at once. Error: corrupt.
  static Result<FanPatchDecoder> begin_polygons(Bytes bytes, uint32_t points, uint64_t corners);
  /// With tables that many patches share, which must stay as well.
  static Result<FanPatchDecoder> begin_shared(Bytes bytes, const FanSlots& slots, uint32_t points,
                                              uint64_t corners, FanBuffers* buffers = nullptr);
  /// The same where these are tables of polygons, all at once.
  static Result<FanPatchDecoder> begin_shared_polygons(Bytes bytes, const FanSlots& slots, uint32_t points,
                                                       uint64_t corners);
  /// Decodes what is left. The result fits `blocks` and `points`, or corrupt.
  Result<FanPatch> finish(std::span<const BlockShape> blocks, uint32_t points, uint64_t corners);

  Result<> read_sections(ByteReader& in, uint64_t count, uint64_t corners);
  /// How often triangles lie again, in all; corrupt where that does not fit.
  Result<uint64_t> count_duplicates(uint64_t corners) const;

  Bytes duplicates;     ///< runs: how often each triangle lies again
  Bytes turned;         ///< runs: triangles that run the other way
  Bytes block_numbers;  ///< runs
  Bytes loose;
  uint32_t faces = 0;  ///< without duplicates
};

/// Builds the surface of `topology` for coders that walk over half-edges, unless it is there. It follows from
/// the decoded faces alone, so it is the same on both sides; the gluing that the encoder began with is not
/// coded. Error: corrupt, for faces with a vertex twice (decoded from damaged bytes).
Result<> build_surface(const FanSurface& fans, PatchTopology& topology);

/// As assemble_cells(), where half-edges were not built. Places stay empty where they are the same: with one
/// block.
AssembledCells assemble_fans(FanSurface fans, const PatchTopology& topology,
                             std::span<const BlockShape> blocks, bool with_places);

}  // namespace maille
