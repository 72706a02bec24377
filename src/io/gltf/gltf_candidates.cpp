// Which primitives the extension can hold, and the vertices and triangles that they share: many primitives
// may have the same accessors, which are coded once.
#include <algorithm>

#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/gltf/gltf_compress.h"
#include "io/gltf/gltf_names.h"
#include "io/reading.h"

namespace maille {
namespace {

/// Extensions of primitives that do not speak of vertices or triangles by their numbers. All others are
/// unknown, and may.
constexpr std::string_view harmless_extensions[] = {"KHR_materials_variants"};

std::string name_in_file(const std::string& semantic, int target) {
  const std::string name = semantic == "POSITION" ? gltf_positions : name_of_gltf(semantic).first;
  return target < 0 ? name : "target" + std::to_string(target) + "." + name;
}

/// Deltas of normals are no unit vectors, so targets have no role.
Role role_in_file(const std::string& semantic, int target) {
  return target < 0 ? name_of_gltf(semantic).second : Role::none;
}

}  // namespace

std::string GltfCompressor::reason_against(const tinygltf::Accessor& accessor) const {
  const auto layout = accessors_.layout(accessor, "");
  if (!layout || layout->columns != 1 || gltf_component_type(layout->type) == 0)
    return "an attribute is a matrix or of a type that glTF does not have";
  return "";
}

std::string GltfCompressor::reason_against(const tinygltf::Primitive& primitive, const GltfJson& json) const {
  if (primitive.mode != TINYGLTF_MODE_TRIANGLES) return "points, lines, strips or fans";
  if (primitive.attributes.count("POSITION") == 0) return "no positions";
  const GltfJson* extensions = gltf_member(json, "extensions");
  if (extensions != nullptr) {
    for (const auto& [name, value] : extensions->items()) {
      if (std::find(std::begin(harmless_extensions), std::end(harmless_extensions), name) ==
          std::end(harmless_extensions))
        return "the extension " + name + ", which may number vertices";
    }
  }
  return "";
}

Result<std::vector<GltfVertices::Attribute>> GltfCompressor::attributes_of(
    const tinygltf::Primitive& primitive) const {
  std::vector<GltfVertices::Attribute> attributes;
  const auto add = [&](const std::string& semantic, int target, int index) -> Result<> {
    const std::string where = "accessor " + std::to_string(index) + " (" + semantic + ")";
    const tinygltf::Accessor* accessor = MAILLE_TRY(accessors_.get(index, "attribute " + semantic));
    GltfVertices::Attribute attribute = {
        semantic, name_in_file(semantic, target), target,
        index,    role_in_file(semantic, target), MAILLE_TRY(accessors_.layout(*accessor, where))};
    // "_normal" beside "NORMAL" would have the same name.
    const bool taken = std::any_of(attributes.begin(), attributes.end(),
                                   [&](const auto& other) { return other.name == attribute.name; });
    if (taken) attribute.name = semantic + "." + std::to_string(attributes.size());
    attributes.push_back(std::move(attribute));
    return {};
  };
  MAILLE_CHECK(add("POSITION", -1, primitive.attributes.at("POSITION")));
  for (const auto& [semantic, index] : primitive.attributes) {
    if (semantic != "POSITION") MAILLE_CHECK(add(semantic, -1, index));
  }
  for (size_t t = 0; t < primitive.targets.size(); ++t) {
    for (const auto& [semantic, index] : primitive.targets[t])
      MAILLE_CHECK(add(semantic, static_cast<int>(t), index));
  }
  return attributes;
}

bool GltfCompressor::is_blended(int material) const {
  const GltfJson& list = gltf_list(document_.json, "materials");
  if (material < 0 || static_cast<size_t>(material) >= list.size()) return false;
  const GltfJson* mode = gltf_member(list[static_cast<size_t>(material)], "alphaMode");
  return mode != nullptr && *mode == "BLEND";
}

Result<size_t> GltfCompressor::vertices_of(const tinygltf::Primitive& primitive, size_t mesh) {
  GltfVertices vertices;
  vertices.attributes = MAILLE_TRY(attributes_of(primitive));
  vertices.mesh = mesh;
  // Primitives share vertices if they have the same accessors for all attributes and targets.
  std::string key;
  for (const auto& attribute : vertices.attributes) {
    key += attribute.semantic + " " + std::to_string(attribute.target) + " " +
           std::to_string(attribute.accessor) + "\n";
  }
  const auto [known, is_new] = vertices_by_key_.emplace(key, vertices_.size());
  if (!is_new) return known->second;
  vertices.count = MAILLE_TRY(accessors_.get(vertices.attributes[0].accessor, "POSITION"))->count;
  // An accessor without bytes is all zeros, which costs a hostile file nothing, so the budget counts it.
  for (const auto& attribute : vertices.attributes)
    MAILLE_CHECK(budget_.take(vertices.count, attribute.layout.tuple_size()));
  vertices_.push_back(std::move(vertices));
  return vertices_.size() - 1;
}

Result<size_t> GltfCompressor::triangles_of(const tinygltf::Primitive& primitive, size_t vertices,
                                            const std::string& where) {
  const std::string key = std::to_string(vertices) + " " + std::to_string(primitive.indices);
  const auto known = triangles_by_key_.find(key);
  if (known != triangles_by_key_.end()) return known->second;
  GltfTriangles triangles = {vertices, primitive.indices, {}};
  const uint64_t count = vertices_[vertices].count;
  if (primitive.indices < 0) {
    triangles.corners.resize(count);
    for (uint64_t i = 0; i < count; ++i) triangles.corners[i] = static_cast<uint32_t>(i);
  } else {
    const tinygltf::Accessor* accessor = MAILLE_TRY(accessors_.get(primitive.indices, where));
    const GltfLayout layout = MAILLE_TRY(accessors_.layout(*accessor, where + ", indices"));
    const bool known_type =
        layout.components() == 1 && !layout.normalized &&
        (layout.type == Scalar::u8 || layout.type == Scalar::u16 || layout.type == Scalar::u32);
    if (!known_type) return accessors_.malformed(where + ": indices are not unsigned integers");
    MAILLE_CHECK(budget_.take(accessor->count, sizeof(uint32_t) + layout.tuple_size()));
    std::vector<std::byte> bytes(accessor->count * layout.tuple_size());
    MAILLE_CHECK(accessors_.read(*accessor, layout, where + ", indices", bytes));
    for (uint64_t i = 0; i < accessor->count; ++i) {
      const uint64_t index = with_type(layout.type, [&](auto zero) {
        return static_cast<uint64_t>(load<decltype(zero)>(bytes.data() + i * sizeof zero));
      });
      if (index >= count) {
        return accessors_.malformed(where + ": index " + std::to_string(i) + " is vertex " +
                                    std::to_string(index) + ", but there are " + std::to_string(count));
      }
      triangles.corners.push_back(static_cast<uint32_t>(index));
    }
  }
  if (triangles.corners.size() % 3 != 0)
    return accessors_.malformed(where + ": " + std::to_string(triangles.corners.size()) +
                                " indices are no whole number of triangles");
  triangles_by_key_[key] = triangles_.size();
  triangles_.push_back(std::move(triangles));
  return triangles_.size() - 1;
}

Result<> GltfCompressor::add_primitive(size_t m, size_t p) {
  const tinygltf::Primitive& primitive = model_.meshes[m].primitives[p];
  const std::string where = "mesh " + std::to_string(m) + ", primitive " + std::to_string(p);
  std::string reason = reason_against(primitive, document_.json["meshes"][m]["primitives"][p]);
  if (!reason.empty()) return leave(reason), Result<>();
  const auto attributes = MAILLE_TRY(attributes_of(primitive));
  const uint64_t count = MAILLE_TRY(accessors_.get(attributes[0].accessor, where))->count;
  for (const auto& attribute : attributes) {
    const tinygltf::Accessor* accessor = MAILLE_TRY(accessors_.get(attribute.accessor, where));
    if (reason.empty()) reason = reason_against(*accessor);
    if (accessor->count != count) {
      return accessors_.malformed(where + ": " + attribute.semantic + " has " +
                                  std::to_string(accessor->count) + " elements for " + std::to_string(count) +
                                  " positions");
    }
  }
  if (attributes[0].layout.components() != 3) return accessors_.malformed(where + ": POSITION is not VEC3");
  if (count == 0) reason = "no vertices";
  if (!reason.empty()) return leave(reason), Result<>();
  const size_t vertices = MAILLE_TRY(vertices_of(primitive, m));
  // Triangles that are blended are drawn in their order, so it must stay.
  vertices_[vertices].keep_order = vertices_[vertices].keep_order || is_blended(primitive.material);
  const size_t triangles = MAILLE_TRY(triangles_of(primitive, vertices, where));
  if (triangles_[triangles].corners.empty()) return leave("no triangles"), Result<>();
  candidates_.push_back({m, p, triangles});
  return {};
}

void GltfCompressor::find_used_vertices() {
  std::vector<std::vector<bool>> used(vertices_.size());
  for (const GltfTriangles& triangles : triangles_) {
    std::vector<bool>& of = used[triangles.vertices];
    of.resize(vertices_[triangles.vertices].count);
    for (const uint32_t vertex : triangles.corners) of[vertex] = true;
  }
  for (size_t v = 0; v < vertices_.size(); ++v) {
    for (size_t i = 0; i < used[v].size(); ++i) {
      if (used[v][i]) vertices_[v].used.push_back(static_cast<uint32_t>(i));
    }
  }
}

Result<> GltfCompressor::find_candidates() {
  for (size_t m = 0; m < model_.meshes.size(); ++m) {
    for (size_t p = 0; p < model_.meshes[m].primitives.size(); ++p) MAILLE_CHECK(add_primitive(m, p));
  }
  find_used_vertices();
  return {};
}

}  // namespace maille
