#pragma once

#include <maille/encode.h>
#include <maille/limits.h>
#include <maille/source.h>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

// glTF files that stay glTF files: the geometry of triangles moves into .maille files in buffer views, by the
// extension MAILLE_mesh_compression on primitives (docs/gltf.md); everything else of the asset stays.
namespace maille {

struct GltfCompressOptions {
  /// Effort, order, positions, arrays (by their names in maille: "normal", "texcoord", "target0.position"),
  /// executor and progress. `positions` in bits or relative go by the box of each mesh of the asset, so that
  /// its primitives share one lattice; targets of positions get the same absolute bound. Arrays of integers
  /// are lossless whatever is asked. Weights in N bits become multiples of 2^-N that still add up to 1.
  EncodeOptions encoding;
  Limits limits;
  bool text = false;  ///< write .gltf with its buffer as a data URI; otherwise .glb
};

struct GltfReport {
  uint64_t primitives = 0;  ///< of the asset
  uint64_t compressed = 0;  ///< of these
  uint64_t points = 0;      ///< vertices of those compressed
  uint64_t triangles = 0;
  uint64_t files = 0;           ///< .maille files within
  uint64_t geometry_bytes = 0;  ///< values and indices of the primitives compressed, as accessors hold them
  uint64_t coded_bytes = 0;     ///< the .maille files
  uint64_t input_bytes = 0;     ///< with files that the asset names as buffers
  uint64_t file_bytes = 0;
  /// What a user should know: primitives left as they are, and why.
  std::vector<std::string> notes;
};

/// The arrays of points that compress_gltf() would code, without values: names, types and roles for a choice
/// of tolerances. Errors as of read_mesh().
[[nodiscard]] Result<std::vector<Array>> gltf_arrays(const Source& source);

/// Compresses the triangles of a glTF asset and commits the sink. A primitive stays as it is if the extension
/// cannot hold it or does not make it smaller. Errors: those of read_mesh() and encode(); unsupported if the
/// geometry is compressed already.
[[nodiscard]] Result<GltfReport> compress_gltf(const Source& source, Sink& sink,
                                               const GltfCompressOptions& options = {});

struct GltfDecompressOptions {
  Limits limits;
  Executor* executor = nullptr;  ///< nullptr: serial
  bool text = false;             ///< as of GltfCompressOptions
};

/// The inverse: writes a glTF file without the extension and commits the sink. Safe on any input. Errors:
/// those of read_mesh() and decode(); usage if the asset does not use the extension.
[[nodiscard]] Result<GltfReport> decompress_gltf(const Source& source, Sink& sink,
                                                 const GltfDecompressOptions& options = {});

/// One .maille file within a glTF file.
struct GltfPart {
  uint64_t buffer_view = 0;
  std::vector<std::string> primitives;  ///< "engine/0": name or number of the mesh, number of the primitive
  std::vector<std::byte> bytes;         ///< the file
  /// A mesh of the asset, its primitive, and the block of the file that has its triangles.
  struct Place {
    uint64_t mesh = 0, primitive = 0, block = 0;
  };
  std::vector<Place> places;  ///< of `primitives`
};
/// The .maille files of a glTF file, in the order of their buffer views; empty where it does not use the
/// extension, or is no glTF file.
[[nodiscard]] Result<std::vector<GltfPart>> gltf_parts(const Source& source);

/// The meshes that compress_gltf() would give to encode() for these files of a compressed asset, made from
/// the asset it was before, to compare values with. Errors: as of compress_gltf(); differs, where the
/// original has no such primitives.
[[nodiscard]] Result<std::vector<Mesh>> gltf_originals(const Source& original,
                                                       std::span<const GltfPart> parts,
                                                       const Limits& limits = {});
/// Rounds the weights of such a mesh to those of the file, if some number of bits makes them the same;
/// returns that number, 0 where nothing was rounded.
int round_gltf_weights_as(Mesh& original, const Mesh& decoded);

/// A mesh that was read from glTF, as its scene shows it: the transforms of nodes (in its metadata, see
/// io/gltf/gltf.h) applied to positions, normals and tangents, a mesh that several nodes use once for each.
/// Skinned meshes stay as stored. Without a value: there is nothing to apply. Error: malformed_input, where
/// the scene shows far more than the mesh has.
Result<std::optional<Mesh>> mesh_in_scene(const Mesh& mesh, std::vector<std::string>& notes);

}  // namespace maille
