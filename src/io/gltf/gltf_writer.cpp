#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/bytes.h"
#include "base/result.h"
#include "io/base64.h"
#include "io/buffered_writer.h"
#include "io/gltf/gltf.h"
#include "io/gltf/gltf_blob.h"
#include "io/gltf/gltf_writer.h"
#include "io/reading.h"
#include "numbers/number_map.h"

namespace maille {

using json = GltfWriter::Json;

const std::byte* GltfWriter::tuple(const GltfAttribute& attribute, uint64_t point) const {
  const Array& array = *attribute.array;
  // The largest tuple of an attribute: 16 components of 8 bytes.
  static constexpr std::array<std::byte, 16 * 8> zeros{};
  if (array.domain != Domain::corner) {
    const uint64_t old = cells_.old_point.empty() ? point : cells_.old_point[point];
    return array.bytes.data() + old * array.tuple_size();
  }
  const uint64_t corner = cells_.corner_of_point[point];
  return corner == GltfCells::no_corner ? zeros.data() : array.bytes.data() + corner * array.tuple_size();
}

/// Bounds as the standard wants them for positions, over finite values, and of the numbers as they are
/// written.
json GltfWriter::limits_of(const GltfAttribute& attribute, const GltfRange& range) const {
  std::array<double, 3> low, high;
  low.fill(INFINITY);
  high.fill(-INFINITY);
  const Scalar type = attribute.array->type;
  for (uint64_t p = range.first; p < range.first + range.count; ++p) {
    for (size_t k = 0; k < 3; ++k) {
      double value = number_as_double(type, tuple(attribute, p) + k * size_of(type));
      if (attribute.type == Scalar::f32) value = static_cast<double>(static_cast<float>(value));
      if (!std::isfinite(value)) continue;
      low[k] = std::min(low[k], value);
      high[k] = std::max(high[k], value);
    }
  }
  for (size_t k = 0; k < 3; ++k) {
    if (low[k] > high[k]) low[k] = high[k] = 0;
  }
  return json{{"min", low}, {"max", high}};
}

// One buffer view for each attribute, with an accessor for each range of points that has it. Vertices of one
// attribute follow each other, so writing goes over each array once.
void GltfWriter::add_accessors() {
  for (size_t a = 0; a < attributes_.size(); ++a) {
    const GltfAttribute& attribute = attributes_[a];
    const size_t view = document_["bufferViews"].size();
    const uint64_t size = cells_.point_count * attribute.stride();
    document_["bufferViews"].push_back({{"buffer", 0},
                                        {"byteOffset", binary_size_},
                                        {"byteLength", size},
                                        {"byteStride", attribute.stride()},
                                        {"target", 34962}});
    binary_size_ += size;
    for (GltfRange& range : ranges_) {
      const bool used = std::any_of(range.primitives.begin(), range.primitives.end(), [&](size_t i) {
        return mesh_.blocks.empty() || attribute.blocks[cells_.primitives[i].block];
      });
      range.accessors.push_back(used ? static_cast<int>(document_["accessors"].size()) : -1);
      if (!used) continue;
      json accessor = {{"bufferView", view},
                       {"byteOffset", range.first * attribute.stride()},
                       {"componentType", gltf_component_type(attribute.type)},
                       {"count", range.count},
                       {"type", gltf_shape_of(attribute.array->components)}};
      if (attribute.normalized) accessor["normalized"] = true;
      if (a == 0) accessor.update(limits_of(attribute, range));
      document_["accessors"].push_back(std::move(accessor));
    }
  }
}

namespace {

/// Whether indices of a range have 16 bits. 65535 itself means "restart" to graphics hardware and is not
/// used.
bool is_short(const GltfRange& range) {
  return range.count <= 65535;
}

}  // namespace

void GltfWriter::add_indices() {
  const size_t view = document_["bufferViews"].size();
  const uint64_t first = binary_size_;
  for (size_t i = 0; i < cells_.primitives.size(); ++i) {
    const GltfPrimitive& primitive = cells_.primitives[i];
    indices_accessor_.push_back(primitive.indices.empty() ? -1
                                                          : static_cast<int>(document_["accessors"].size()));
    if (primitive.indices.empty()) continue;
    const bool is_16_bit = is_short(ranges_[range_of_[i]]);
    document_["accessors"].push_back({{"bufferView", view},
                                      {"byteOffset", binary_size_ - first},
                                      {"componentType", is_16_bit ? 5123 : 5125},
                                      {"count", primitive.indices.size()},
                                      {"type", "SCALAR"}});
    const uint64_t size = primitive.indices.size() * (is_16_bit ? 2 : 4);
    // glTF wants accessors at multiples of their components' size; 4 suits both kinds of indices.
    binary_size_ += (size + 3) / 4 * 4;
  }
  if (binary_size_ == first) return;
  document_["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", first}, {"byteLength", binary_size_ - first}, {"target", 34963}});
}

json GltfWriter::primitive_of(size_t i) const {
  const GltfPrimitive& primitive = cells_.primitives[i];
  json object = {{"attributes", json::object()}};
  for (size_t a = 0; a < attributes_.size(); ++a) {
    const int accessor = ranges_[range_of_[i]].accessors[a];
    const bool has = mesh_.blocks.empty() || attributes_[a].blocks[primitive.block];
    if (has && accessor >= 0) object["attributes"][attributes_[a].semantic] = accessor;
  }
  if (indices_accessor_[i] >= 0) object["indices"] = indices_accessor_[i];
  if (primitive.material >= 0) object["material"] = primitive.material;
  if (primitive.mode != GltfPrimitive::triangles) object["mode"] = static_cast<int>(primitive.mode);
  return object;
}

/// Blocks by mesh: "tree/0", "tree/1", ... become one mesh "tree"; other blocks a mesh each.
std::vector<std::vector<size_t>> GltfWriter::meshes_by_name() const {
  std::vector<std::vector<size_t>> meshes;
  for (size_t b = 0; b < mesh_.blocks.size(); ++b) {
    if (!meshes.empty()) {
      std::vector<size_t>& open = meshes.back();
      const std::string& first = mesh_.blocks[open[0]].name;
      const std::string stem = first.ends_with("/0") ? first.substr(0, first.size() - 1) : "";
      if (!stem.empty() && mesh_.blocks[b].name == stem + std::to_string(open.size())) {
        open.push_back(b);
        continue;
      }
    }
    meshes.push_back({b});
  }
  if (meshes.empty()) meshes.push_back({0});  // points only
  return meshes;
}

json GltfWriter::mesh_of(const std::vector<size_t>& blocks) {
  json mesh = json::object();
  if (!mesh_.blocks.empty() && !blocks.empty()) {
    std::string name = mesh_.blocks[blocks[0]].name;
    if (blocks.size() > 1 && name.ends_with("/0")) name.resize(name.size() - 2);
    if (!name.empty()) mesh["name"] = name;
  }
  mesh["primitives"] = json::array();
  for (const size_t block : blocks) {
    for (const size_t i : primitives_of_block_[block]) mesh["primitives"].push_back(primitive_of(i));
  }
  return mesh;
}

/// Takes nodes as the file had them that the mesh was read from, if its blocks are still the same. All
/// numbers in the metadata are checked, as anybody may have written them.
bool GltfWriter::add_nodes_from_metadata(std::vector<std::vector<size_t>>& meshes) {
  const json nodes = gltf_metadata(mesh_, "gltf.nodes"), roots = gltf_metadata(mesh_, "gltf.scene"),
             blocks = gltf_metadata(mesh_, "gltf.meshes");
  if (!nodes.is_array() || !roots.is_array() || !blocks.is_array()) return false;
  const auto all_below = [](const json& list, size_t limit) {
    return list.is_array() && std::all_of(list.begin(), list.end(), [&](const json& x) {
             return x.is_number_unsigned() && x.get<uint64_t>() < limit;
           });
  };
  std::vector<std::vector<size_t>> found;
  size_t count = 0;
  for (const json& list : blocks) {
    if (!all_below(list, mesh_.blocks.size())) return false;
    found.push_back(list.get<std::vector<size_t>>());
    count += list.size();
  }
  json kept = json::array();
  for (const json& node : nodes) {
    if (!node.is_object()) return false;
    kept.push_back(node);
    // Their targets are not in the mesh, so the numbers would name nothing.
    for (const char* gone : {"skin", "camera", "extensions"}) kept.back().erase(gone);
    if (node.contains("children") && !all_below(node["children"], nodes.size())) return false;
    if (!node.contains("mesh")) continue;
    if (!node["mesh"].is_number_unsigned() || node["mesh"].get<uint64_t>() >= found.size()) return false;
    if (found[node["mesh"].get<size_t>()].empty()) kept.back().erase("mesh");
  }
  if (count != mesh_.blocks.size() || !all_below(roots, nodes.size()) || roots.empty()) return false;
  document_["nodes"] = std::move(kept);
  document_["scenes"] = json::array({{{"nodes", roots}}});
  meshes = std::move(found);
  return true;
}

void GltfWriter::add_meshes() {
  primitives_of_block_.resize(std::max<size_t>(mesh_.blocks.size(), 1));
  for (size_t i = 0; i < cells_.primitives.size(); ++i) {
    primitives_of_block_[cells_.primitives[i].block].push_back(i);
  }
  std::vector<std::vector<size_t>> meshes = meshes_by_name();
  const bool known_nodes = add_nodes_from_metadata(meshes);
  // Meshes without primitives are not allowed, so they are left out and later ones get other numbers.
  std::vector<int> new_number;
  json roots = json::array();
  for (const std::vector<size_t>& blocks : meshes) {
    json mesh = mesh_of(blocks);
    new_number.push_back(mesh["primitives"].empty() ? -1 : static_cast<int>(document_["meshes"].size()));
    if (new_number.back() < 0) continue;
    if (!known_nodes) {
      roots.push_back(document_["nodes"].size());
      document_["nodes"].push_back({{"mesh", document_["meshes"].size()}});
    }
    document_["meshes"].push_back(std::move(mesh));
  }
  if (!known_nodes) {
    document_["scenes"] = json::array({{{"nodes", roots}}});
    return;
  }
  for (json& node : document_["nodes"]) {
    if (!node.contains("mesh")) continue;
    const int number = new_number[node["mesh"].get<size_t>()];
    if (number < 0) {
      node.erase("mesh");
    } else {
      node["mesh"] = number;
    }
  }
}

json GltfWriter::asset() const {
  json asset = gltf_metadata(mesh_, "gltf.asset");
  // The asset speaks of the model, also of who made it: it stays as it was.
  if (!asset.is_object()) asset = {{"generator", "maille"}};
  asset["version"] = "2.0";
  if (asset.contains("minVersion") && asset["minVersion"] != "2.0") asset.erase("minVersion");
  json pairs = json::array();
  for (const auto& [key, value] : mesh_.metadata) {
    if (!key.starts_with("gltf.")) pairs.push_back({key, value});
  }
  if (!pairs.empty()) {
    if (!asset["extras"].is_object()) asset["extras"] = json::object();
    asset["extras"]["maille_metadata"] = std::move(pairs);
  }
  return asset;
}

void GltfWriter::put_attribute(BufferedWriter& out, const GltfAttribute& attribute) const {
  const Array& array = *attribute.array;
  const size_t padding = attribute.stride() - attribute.tight_size();
  // The usual case: the array is written as it is in memory.
  if (array.type == attribute.type && padding == 0 && cells_.old_point.empty()) {
    out.put_bytes(array.bytes);
    return;
  }
  const size_t size = size_of(array.type);
  for (uint64_t p = 0; p < cells_.point_count; ++p) {
    const std::byte* from = tuple(attribute, p);
    if (array.type == attribute.type) {
      out.put_bytes(Bytes(from, array.tuple_size()));
    } else {
      for (uint32_t k = 0; k < array.components; ++k) {
        out.put_raw(static_cast<float>(number_as_double(array.type, from + k * size)));
      }
    }
    for (size_t k = 0; k < padding; ++k) out.put('\0');
  }
}

void GltfWriter::put_indices(BufferedWriter& out) const {
  for (size_t i = 0; i < cells_.primitives.size(); ++i) {
    const GltfPrimitive& primitive = cells_.primitives[i];
    const GltfRange& range = ranges_[range_of_[i]];
    for (const uint32_t point : primitive.indices) {
      const uint64_t index = point - range.first;
      if (is_short(range)) {
        out.put_raw(static_cast<uint16_t>(index));
      } else {
        out.put_raw(static_cast<uint32_t>(index));
      }
    }
    if (is_short(range) && primitive.indices.size() % 2 != 0) out.put_raw(uint16_t{0});
  }
}

void GltfWriter::put_binary(BufferedWriter& out) const {
  for (const GltfAttribute& attribute : attributes_) put_attribute(out, attribute);
  put_indices(out);
}

Result<> GltfWriter::write_glb() {
  std::string text = document_.dump(-1, ' ', false, json::error_handler_t::replace);
  // GLB: chunks begin at multiples of 4 bytes, and JSON is filled up with blanks (glTF 2.0, 4.4.3.2).
  while (text.size() % 4 != 0) text += ' ';
  const uint64_t size = 12 + 8 + text.size() + (binary_size_ == 0 ? 0 : 8 + binary_size_);
  if (size > UINT32_MAX) {
    return failure(ErrorCode::usage, sink_.name() + ": the mesh takes " + std::to_string(size) +
                                         " bytes, but GLB files end at 4 GiB; write PLY or VTP instead");
  }
  BufferedWriter out(sink_);
  out.put("glTF");
  out.put_raw(uint32_t{2});
  out.put_raw(static_cast<uint32_t>(size));
  out.put_raw(static_cast<uint32_t>(text.size()));
  out.put("JSON");
  out.put(text);
  if (binary_size_ != 0) {
    out.put_raw(static_cast<uint32_t>(binary_size_));
    out.put(std::string_view("BIN\0", 4));
    put_binary(out);
  }
  return out.finish();
}

Result<> GltfWriter::write_gltf() {
  std::vector<std::byte> binary;
  const auto memory = memory_sink(binary);
  BufferedWriter collect(*memory);
  put_binary(collect);
  MAILLE_CHECK(collect.finish());
  if (binary_size_ != 0) {
    document_["buffers"][0]["uri"] = "data:application/octet-stream;base64," + to_base64(binary);
  }
  BufferedWriter out(sink_);
  out.put(document_.dump(1, ' ', false, json::error_handler_t::replace));
  out.put('\n');
  return out.finish();
}

Result<std::vector<std::string>> GltfWriter::write() {
  cells_ = MAILLE_TRY(collect_gltf_cells(mesh_, notes_));
  plan_attributes();
  note_rest();
  plan_ranges();
  document_["asset"] = asset();
  if (!cells_.primitives.empty()) {
    document_["scene"] = 0;
    for (const char* key : {"scenes", "nodes", "meshes", "accessors", "bufferViews"})
      document_[key] = json::array();
    add_accessors();
    add_indices();
    add_meshes();
    document_["buffers"] = json::array({{{"byteLength", binary_size_}}});
  } else {
    notes_.push_back("the mesh is empty, the file has no mesh");
  }
  if (cells_.material) {
    for (const std::string& name : cells_.materials) {
      document_["materials"].push_back(name.empty() ? json::object() : json{{"name", name}});
    }
  }
  if (quantized_) {
    document_["extensionsUsed"] = {"KHR_mesh_quantization"};
    document_["extensionsRequired"] = {"KHR_mesh_quantization"};
  }
  MAILLE_CHECK(binary_ ? write_glb() : write_gltf());
  return std::move(notes_);
}

Result<std::vector<std::string>> write_gltf(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  const bool text = options.ascii || options.format == "gltf";
  return GltfWriter(mesh, sink, !text).write();
}

}  // namespace maille
