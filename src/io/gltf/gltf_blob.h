#pragma once

#include <maille/limits.h>
#include <maille/mesh.h>

#include <string>
#include <utility>
#include <vector>

#include "io/gltf/gltf_document.h"

// What the extension object of a primitive says, and the rule that makes accessors of a decoded mesh; for the
// encoder, which needs counts and bounds of what will come out, and the decoder. docs/gltf.md.

namespace maille {

/// Semantics of glTF, each with the name of the array that holds its values.
using GltfNames = std::vector<std::pair<std::string, std::string>>;

/// What the extension object of a primitive says: the buffer view with the .maille file, the block of it with
/// the primitive's triangles, and where the values of attributes and of morph targets are in it.
struct GltfLink {
  uint64_t view = 0, block = 0;
  GltfNames attributes;
  std::vector<GltfNames> targets;
};

// A pair: what to_json() writes, link_from_json() reads.
GltfJson to_json(const GltfLink& link);
/// `where`: for messages. Error: malformed_input.
Result<GltfLink> link_from_json(const GltfJson& object, const std::string& where);

/// The vertices of primitives that share accessors, by their points in a decoded mesh: in rising order the
/// points that their blocks use; where no other primitive has triangles in the file (`alone`), all points.
/// Both sides number vertices so, and nothing about it is in the file.
std::vector<uint32_t> gltf_vertices(const Mesh& mesh, const std::vector<uint64_t>& blocks, bool alone);

/// The name of positions, which are no array of a mesh.
inline constexpr const char* gltf_positions = "position";
/// Positions or an array of points; nullptr where there is none.
const Array* gltf_array(const Mesh& mesh, const std::string& name);

/// The tuples of an array at these points, tightly packed.
std::vector<std::byte> gltf_values(const Array& array, const std::vector<uint32_t>& vertices);
/// Numbers of vertices of a block's corners; each of its points is among `vertices`, which rise.
std::vector<uint32_t> gltf_indices(const CellBlock& block, const std::vector<uint32_t>& vertices);

/// componentType of the standard; 0: it has none.
int gltf_component_type(Scalar type);
/// Sets the least and largest value of each component, of finite ones, as JSON; 0 where there are none.
void set_gltf_limits(GltfJson& accessor, const Array& array, const std::vector<uint32_t>& vertices);

}  // namespace maille
