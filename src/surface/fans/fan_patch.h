#pragma once

#include <optional>

#include "base/bytes.h"
#include "surface/fans/fan_connectivity.h"
#include "surface/patch_topology.h"

namespace maille {

struct FanTables;

/// A patch at the fast and default levels: TOPO 1 (triangles), 2 (polygons) and 3 (either, with shared
/// tables): docs/format.md, 12.1 and 17.7.
struct FanPatch {
  /// In the mesh's orientation; faces that lie more than once follow behind all others.
  FanSurface fans;
  /// Blocks of faces, loose cells and number of points. The surface in it is not built, only counted.
  PatchTopology topology;
};

/// What encode_fan_patch() gives; `sources` tells which element of the mesh each coded one is.
struct EncodedFanPatch {
  FanPatch patch;
  PatchSources sources;
  /// The whole of TOPO 1 or 2. Where tables are shared: what stands beside the fans in TOPO 3, none for plain
  /// triangles without other points, which is all that most charts have.
  std::vector<std::byte> bytes;
  std::vector<FanOperation> operations;  ///< of the fans, where tables are shared
};

/// The bytes of a patch with shared tables; these have been made with its operations.
std::vector<std::byte> write_shared_fan_patch(const EncodedFanPatch& coded, const FanTables& tables);

/// Codes the cells of a mesh. There is no value if the mesh has more points than fans can number
/// (most_fan_points); the front takes such meshes. Error: unsupported, for too many corners.
Result<std::optional<EncodedFanPatch>> encode_fan_patch(const Mesh& mesh,
                                                        FanModels models = FanModels::fixed);

/// Inverse, in two steps: begin() reads heads and sections, then positions can be decoded along with `fans`,
/// then finish() decodes what is left. Safe on any bytes. The bytes must stay until finish() has returned.
struct FanPatchDecoder {
  std::optional<FanDecoder> fans;

  /// Of triangles (TOPO 1). Their positions can be decoded along with `fans`. Error: corrupt.
  static Result<FanPatchDecoder> begin(Bytes bytes, uint32_t points, uint64_t corners);
  /// Of polygons (TOPO 2), all of which are decoded at once. Error: corrupt.
  static Result<FanPatchDecoder> begin_polygons(Bytes bytes, uint32_t points, uint64_t corners);
  /// Of triangles with tables that many patches share (TOPO 3). The tables must stay as well.
  static Result<FanPatchDecoder> begin_shared(Bytes bytes, const FanSlots& slots, uint32_t points,
                                              uint64_t corners, FanBuffers* buffers = nullptr);
  /// Of polygons with shared tables (TOPO 3), all at once.
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
