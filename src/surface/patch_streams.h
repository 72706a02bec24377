#pragma once

#include <maille/decode.h>
#include <maille/encode.h>

#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "container/file_reader.h"
#include "container/file_writer.h"
#include "description/description.h"
#include "numbers/number_map.h"
#include "surface/fans/fan_patch.h"
#include "surface/parts/mesh_parts.h"
#include "surface/patch_topology.h"

namespace maille {

/// The streams of one patch: TOPO, POSI, TWIN if it is welded, and an ARRY for each array. A file has one
/// patch, or one for each part of its mesh. docs/format.md, 11.

/// An array of the whole mesh and how its numbers become codes. Positions come first.
struct ArrayToCode {
  const Array* array;
  ArrayMaps maps;
  bool by_twin = false;  ///< on corners, by the twin that each has (WeldedMesh)
};

struct CodedStream {
  StreamKey key;
  std::vector<std::byte> bytes;
};

/// A patch whose fans and positions were coded before, along with others: see shared_fans.h. encode_patch()
/// then only adds arrays.
struct SharedFanPatch {
  EncodedFanPatch coded;
  std::vector<std::byte> positions;
};
struct SharedFanTables;

struct EncodedPatch {
  CodedStream topology;
  std::vector<CodedStream> arrays;  ///< as given; without those of the mesh as a whole but in patch 0
  std::optional<CodedStream> twins;
  std::vector<uint32_t> twin_numbers;  ///< by corner of the mesh, as the decoder has them
  /// Where the coded elements are in the whole mesh: points, and cells where the order is kept.
  PatchSources sources;
  std::vector<uint32_t> border;  ///< of a part: points_on_borders() of what is decoded

  size_t bytes() const {
    size_t sum = topology.bytes.size() + (twins ? twins->bytes.size() : 0);
    for (const CodedStream& stream : arrays) sum += stream.bytes.size();
    return sum;
  }
};

/// Is it of interest where cells and corners of a patch are in the whole mesh?
bool needs_cells(std::span<const ArrayToCode> arrays, Order order);

/// Codes a mesh, or a part of one (`numbers`, else nullptr), as patch number `patch`. Only the cells and the
/// number of points are taken from `mesh`, tuples from `arrays`. `corner_twin`: of a WeldedMesh, which is no
/// part. Errors: unsupported, cancelled.
Result<EncodedPatch> encode_patch(const Mesh& mesh, const PartNumbers* numbers, uint32_t patch,
                                  std::span<const ArrayToCode> arrays, const EncodeOptions& options,
                                  std::optional<SharedFanPatch> shared = std::nullopt,
                                  std::span<const uint32_t> corner_twin = {});

/// The same for a part, which it lets go of before it codes arrays.
Result<EncodedPatch> encode_part(MeshPart part, uint32_t patch, std::span<const ArrayToCode> arrays,
                                 const EncodeOptions& options);

/// An array of the mesh as a whole (metadata of one tuple or a few), which no patch has, and its inverse.
/// Safe on any bytes. Error: corrupt.
std::vector<std::byte> encode_mesh_array(const ArrayToCode& coded);
Result<> decode_mesh_array(Bytes bytes, uint64_t tuples, Array& array);

struct DecodedPatch {
  Mesh mesh;
  bool known_valid = false;  ///< validate() would only find what the decoder has seen already
  // Of a welded mesh:
  std::vector<uint32_t> twins;  ///< by corner
  std::vector<bool> by_twin;    ///< by array of `mesh`
};

/// Arrays that cannot be had of a damaged file, by their places in the description: several may have one
/// name.
using LostArrays = std::set<size_t>;

/// Inverse of encode_patch(). `description` is that of the part; `tables`: where patches share them;
/// `buffers`: memory that one patch after the other may use; `lost`: not null: damaged arrays are left out,
/// and told there. The result fits the description, but is validated only as far as known_valid says. Safe on
/// any bytes. Errors: corrupt, cancelled, and those of the source.
Result<DecodedPatch> decode_patch(const StreamSource& streams, const Description& description, uint32_t patch,
                                  const DecodeOptions& options, const SharedFanTables* tables = nullptr,
                                  FanBuffers* buffers = nullptr, LostArrays* lost = nullptr);

/// Whether half-edges or mixing decode a patch of these streams, which take more memory than fans.
bool is_of_front(const StreamSource& streams, uint32_t patch);

/// An array's stream, by its place in the description; that of twins.
inline StreamKey array_key(uint32_t patch, size_t i) {
  return {"ARRY", patch, static_cast<uint32_t>(i)};
}
inline StreamKey twins_key(uint32_t patch) {
  return {"TWIN", patch};
}

}  // namespace maille
