#include "io/gltf/gltf_blob.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "base/bytes.h"
#include "base/sort_unique.h"
#include "io/gltf/gltf_writer.h"
#include "numbers/number_map.h"

namespace maille {
namespace {

GltfJson names_to_json(const GltfNames& names) {
  GltfJson object = GltfJson::object();
  for (const auto& [semantic, name] : names) object[semantic] = name;
  return object;
}

Result<GltfNames> names_from_json(const GltfJson& object, const std::string& where) {
  GltfNames names;
  if (!object.is_object()) return failure(ErrorCode::malformed_input, where + " is no object of names");
  for (const auto& [semantic, name] : object.items()) {
    if (!name.is_string())
      return failure(ErrorCode::malformed_input, where + ": " + semantic + " is no name of an array");
    names.emplace_back(semantic, name.get<std::string>());
  }
  return names;
}

}  // namespace

GltfJson to_json(const GltfLink& link) {
  GltfJson object = {{"bufferView", link.view}};
  if (link.block != 0) object["block"] = link.block;
  object["attributes"] = names_to_json(link.attributes);
  for (const GltfNames& target : link.targets) object["targets"].push_back(names_to_json(target));
  return object;
}

Result<GltfLink> link_from_json(const GltfJson& object, const std::string& where) {
  GltfLink link;
  const auto view = gltf_number(object, "bufferView");
  if (!view) return failure(ErrorCode::malformed_input, where + " names no buffer view");
  link.view = *view;
  if (gltf_member(object, "block")) {
    const auto block = gltf_number(object, "block");
    if (!block) return failure(ErrorCode::malformed_input, where + ": block is no whole number");
    link.block = *block;
  }
  const GltfJson* attributes = gltf_member(object, "attributes");
  if (!attributes) return failure(ErrorCode::malformed_input, where + " has no attributes");
  link.attributes = MAILLE_TRY(names_from_json(*attributes, where + ", attributes"));
  for (const GltfJson& target : gltf_list(object, "targets"))
    link.targets.push_back(MAILLE_TRY(names_from_json(target, where + ", targets")));
  return link;
}

// A block's points, rising, are the vertices of its primitive; `alone`: all points are, also those that no
// triangle has.
std::vector<uint32_t> gltf_vertices(const Mesh& mesh, const std::vector<uint64_t>& blocks, bool alone) {
  std::vector<uint32_t> vertices;
  if (alone) {
    vertices.resize(mesh.point_count());
    std::iota(vertices.begin(), vertices.end(), 0u);
    return vertices;
  }
  for (const uint64_t block : blocks) {
    const Buffer<uint32_t>& corners = mesh.blocks[block].connectivity;
    vertices.insert(vertices.end(), corners.begin(), corners.end());
  }
  sort_unique(vertices);
  return vertices;
}

const Array* gltf_array(const Mesh& mesh, const std::string& name) {
  return name == gltf_positions ? &mesh.points : mesh.find(name, Domain::point);
}

std::vector<std::byte> gltf_values(const Array& array, const std::vector<uint32_t>& vertices) {
  const size_t size = array.tuple_size();
  std::vector<std::byte> values(vertices.size() * size);
  for (size_t i = 0; i < vertices.size(); ++i)
    std::memcpy(values.data() + i * size, array.bytes.data() + vertices[i] * size, size);
  return values;
}

std::vector<uint32_t> gltf_indices(const CellBlock& block, const std::vector<uint32_t>& vertices) {
  std::vector<uint32_t> indices = block.connectivity.vector();
  // Vertices rise, so the last one tells whether all points up to it are vertices, which then keep their
  // numbers.
  const bool all = !vertices.empty() && vertices.back() + size_t{1} == vertices.size();
  if (all) return indices;
  for (uint32_t& point : indices) {
    const auto found = std::lower_bound(vertices.begin(), vertices.end(), point);
    point = static_cast<uint32_t>(found - vertices.begin());
  }
  return indices;
}

// glTF 2.0, 3.6.2.2: the numbers are those of OpenGL. 5124, signed integers of 32 bits, is left out there; 0
// says that a type cannot be stored.
int gltf_component_type(Scalar type) {
  switch (type) {
    case Scalar::i8:
      return 5120;
    case Scalar::u8:
      return 5121;
    case Scalar::i16:
      return 5122;
    case Scalar::u16:
      return 5123;
    case Scalar::u32:
      return 5125;
    case Scalar::f32:
      return 5126;
    default:
      return 0;
  }
}

void set_gltf_limits(GltfJson& accessor, const Array& array, const std::vector<uint32_t>& vertices) {
  accessor["min"] = GltfJson::array();
  accessor["max"] = GltfJson::array();
  const size_t size = size_of(array.type);
  for (size_t k = 0; k < array.components; ++k) {
    double low = INFINITY, high = -INFINITY;
    for (const uint32_t vertex : vertices) {
      const double value =
          number_as_double(array.type, array.bytes.data() + vertex * array.tuple_size() + k * size);
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    // No finite value: JSON has no infinity, and the standard wants numbers.
    if (low > high) low = high = 0;
    if (is_float(array.type)) {
      accessor["min"].push_back(low);
      accessor["max"].push_back(high);
    } else {
      accessor["min"].push_back(static_cast<int64_t>(low));
      accessor["max"].push_back(static_cast<int64_t>(high));
    }
  }
}

}  // namespace maille
