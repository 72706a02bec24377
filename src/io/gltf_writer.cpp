#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "base/bytes.h"
#include "base/result.h"
#include "io/base64.h"
#include "io/buffered_writer.h"
#include "io/gltf.h"
#include "io/gltf_cells.h"
#include "io/gltf_names.h"
#include "io/reading.h"

namespace maille {
namespace {

using json = nlohmann::ordered_json;

/// One array as it will stand in the file.
struct Attribute {
  std::string semantic;
  const Array* array = nullptr;
  Scalar type = Scalar::f32;  ///< as written
  bool normalized = false;
  std::vector<bool> blocks;  ///< which have it

  uint64_t tight_size() const { return size_of(type) * array->components; }
  /// Elements of vertex attributes start at multiples of four bytes.
  uint64_t stride() const { return (tight_size() + 3) / 4 * 4; }
};

/// A range of points used by a run of primitives, which no other primitive uses.
struct Range {
  uint64_t first = 0, count = 0;
  std::vector<size_t> primitives;
  std::vector<int> accessors;  ///< one per attribute, -1 where it is left out
};

json parsed(const Mesh& mesh, const char* key) {
  for (const auto& [name, value] : mesh.metadata) {
    if (name == key) return json::parse(value, nullptr, false);
  }
  return json();
}

const char* shape_of(uint32_t components) {
  switch (components) {
    case 1:
      return "SCALAR";
    case 2:
      return "VEC2";
    case 3:
      return "VEC3";
    case 4:
      return "VEC4";
    case 9:
      return "MAT3";
    case 16:
      return "MAT4";
    default:
      return nullptr;
  }
}

int component_type_of(Scalar type) {
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
    default:
      return 5126;
  }
}

double number_at(const std::byte* from, Scalar type) {
  return with_type(type, [&](auto zero) { return static_cast<double>(load<decltype(zero)>(from)); });
}

class GltfWriter {
 public:
  GltfWriter(const Mesh& mesh, Sink& sink, bool binary)
      : mesh_(mesh), sink_(sink), binary_(binary), normalized_(names_in("gltf.normalized")) {}

  Result<std::vector<std::string>> write();

 private:
  std::set<std::string> names_in(const char* key) const;
  void plan_positions();
  void plan_attributes();
  void plan_attribute(const Array& array, const json& only);
  Scalar type_written(const Array& array);
  std::string semantic_for(const Array& array, Scalar type) const;
  std::string free_semantic(const std::string& wanted, const std::vector<bool>& blocks) const;
  bool taken(const std::string& semantic, const std::vector<bool>& blocks) const;
  void note_rest();

  void plan_ranges();
  void add_accessors();
  json limits_of(const Attribute& attribute, const Range& range) const;
  void add_indices();

  void add_meshes();
  std::vector<std::vector<size_t>> meshes_by_name() const;
  bool add_nodes_from_metadata(std::vector<std::vector<size_t>>& meshes);
  json mesh_of(const std::vector<size_t>& blocks);
  json primitive_of(size_t index) const;
  json asset() const;

  void put_binary(BufferedWriter& out) const;
  void put_attribute(BufferedWriter& out, const Attribute& attribute) const;
  void put_indices(BufferedWriter& out) const;
  Result<> write_glb();
  Result<> write_gltf();

  const std::byte* tuple(const Attribute& attribute, uint64_t point) const;

  const Mesh& mesh_;
  Sink& sink_;
  bool binary_;
  std::set<std::string> normalized_;
  GltfCells cells_;
  std::vector<Attribute> attributes_;  ///< positions first
  std::vector<Range> ranges_;
  std::vector<size_t> range_of_;  ///< of each primitive
  std::vector<std::vector<size_t>> primitives_of_block_;
  std::vector<int> indices_accessor_;
  json document_ = json::object();
  uint64_t binary_size_ = 0;
  bool quantized_ = false;
  std::vector<std::string> notes_;
};

std::set<std::string> GltfWriter::names_in(const char* key) const {
  std::set<std::string> names;
  const json list = parsed(mesh_, key);
  if (!list.is_array()) return names;
  for (const json& name : list) {
    if (name.is_string()) names.insert(name.get<std::string>());
  }
  return names;
}

/// Attributes are 8 or 16 bit integers or 32 bit floats.
Scalar GltfWriter::type_written(const Array& array) {
  if (array.type == Scalar::f32 || size_of(array.type) <= 2) return array.type;
  uint64_t rounded = 0;
  double worst = 0;
  const size_t size = size_of(array.type);
  for (size_t at = 0; at < array.bytes.size(); at += size) {
    const double value = number_at(array.bytes.data() + at, array.type);
    const double error = std::fabs(value - static_cast<double>(static_cast<float>(value)));
    if (std::isfinite(error)) worst = std::max(worst, error);
    rounded += error != 0 && !std::isnan(value);
  }
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", worst);
  notes_.push_back("\"" + array.name + "\" is written as f32, glTF has no " + name_of(array.type) + ": " +
                   (rounded == 0 ? std::string("all values are exact")
                                 : counted(rounded, "value") + " rounded, by up to " + text));
  return Scalar::f32;
}

void GltfWriter::plan_positions() {
  Attribute position;
  position.semantic = "POSITION";
  position.array = &mesh_.points;
  position.type = type_written(mesh_.points);
  position.normalized = normalized_.count("position") != 0 && !is_float(position.type);
  position.blocks.assign(mesh_.blocks.size(), true);
  quantized_ = !is_float(position.type);
  attributes_.push_back(std::move(position));
}

/// glTF's name for an array by its meaning and shape, or one of its own behind an underscore.
std::string GltfWriter::semantic_for(const Array& array, Scalar type) const {
  const uint32_t n = array.components;
  const bool is_unsigned = type == Scalar::u8 || type == Scalar::u16;
  const bool is_signed = type == Scalar::i8 || type == Scalar::i16;
  const auto named = [&](std::string_view name) {
    return array.name == name || array.name.starts_with(std::string(name) + "_") ||
           array.name.starts_with(std::string(name) + ".");
  };
  if (array.role == Role::normal && n == 3 && !is_unsigned) return "NORMAL";
  if (array.role == Role::tangent && n == 4 && !is_unsigned) return "TANGENT";
  if (array.role == Role::texture_coordinate && n == 2) return "TEXCOORD_0";
  if (array.role == Role::colour && (n == 3 || n == 4) && !is_signed) return "COLOR_0";
  if (named("joints") && n == 4 && is_unsigned) return "JOINTS_0";
  if (named("weights") && n == 4 && !is_signed) return "WEIGHTS_0";
  return "_" + array.name;
}

bool GltfWriter::taken(const std::string& semantic, const std::vector<bool>& blocks) const {
  for (const Attribute& other : attributes_) {
    if (other.semantic != semantic) continue;
    for (size_t b = 0; b < blocks.size(); ++b) {
      if (blocks[b] && other.blocks[b]) return true;
    }
    if (blocks.empty()) return true;
  }
  return false;
}

/// The next number, or an own name, that no array of the same primitives has.
std::string GltfWriter::free_semantic(const std::string& wanted, const std::vector<bool>& blocks) const {
  if (!taken(wanted, blocks)) return wanted;
  const bool numbered = wanted.ends_with("_0") && wanted[0] != '_';
  const std::string stem =
      numbered ? wanted.substr(0, wanted.size() - 1) : (wanted[0] == '_' ? "" : "_") + wanted + "_";
  for (unsigned i = 1;; ++i) {
    const std::string next = stem + std::to_string(i);
    if (!taken(next, blocks)) return next;
  }
}

void GltfWriter::plan_attribute(const Array& array, const json& only) {
  if (!shape_of(array.components) ||
      (array.components > 4 && array.type != Scalar::f32 && size_of(array.type) <= 2)) {
    notes_.push_back("array \"" + array.name + "\" left out: glTF has no " +
                     std::to_string(array.components) + " components of " + name_of(array.type));
    return;
  }
  Attribute attribute;
  attribute.array = &array;
  attribute.type = type_written(array);
  attribute.blocks.assign(mesh_.blocks.size(), true);
  const auto partial = only.is_object() ? only.find(array.name) : only.end();
  if (only.is_object() && partial != only.end() && partial->is_array()) {
    attribute.blocks.assign(mesh_.blocks.size(), false);
    for (const json& block : *partial) {
      if (block.is_number_unsigned() && block.get<uint64_t>() < attribute.blocks.size()) {
        attribute.blocks[block.get<size_t>()] = true;
      }
    }
  }
  attribute.semantic = free_semantic(semantic_for(array, attribute.type), attribute.blocks);
  const bool integers = !is_float(attribute.type);
  const std::string& semantic = attribute.semantic;
  const bool fractions = semantic.starts_with("COLOR_") || semantic.starts_with("WEIGHTS_") ||
                         semantic == "NORMAL" || semantic == "TANGENT";
  attribute.normalized = integers && (fractions || normalized_.count(array.name) != 0);
  const bool core = semantic[0] == '_' || semantic.starts_with("COLOR_") ||
                    semantic.starts_with("WEIGHTS_") || semantic.starts_with("JOINTS_") ||
                    (semantic.starts_with("TEXCOORD_") && attribute.normalized &&
                     (attribute.type == Scalar::u8 || attribute.type == Scalar::u16));
  quantized_ = quantized_ || (integers && !core);
  attributes_.push_back(std::move(attribute));
}

void GltfWriter::plan_attributes() {
  plan_positions();
  const json only = parsed(mesh_, "gltf.only");
  for (const Array& array : mesh_.arrays) {
    if (array.domain == Domain::point || array.domain == Domain::corner) plan_attribute(array, only);
  }
}

void GltfWriter::note_rest() {
  for (const Array& array : mesh_.arrays) {
    if (array.domain == Domain::mesh || (array.domain == Domain::cell && &array != cells_.material)) {
      notes_.push_back("array \"" + array.name + "\" left out: glTF has no arrays on " +
                       name_of(array.domain) + (array.domain == Domain::cell ? "s" : "es"));
    }
  }
}

/// Cuts the points where no primitive before uses one behind: every range becomes accessors of its own, with
/// indices as small as they can be. Ranges follow each other, so unused points stay too.
void GltfWriter::plan_ranges() {
  const size_t n = cells_.primitives.size();
  std::vector<uint64_t> least(n + 1, cells_.point_count);
  for (size_t i = n; i-- > 0;) least[i] = std::min(least[i + 1], uint64_t{cells_.primitives[i].least});
  uint64_t most = 0;
  for (size_t i = 0; i < n; ++i) {
    if (i == 0 || least[i] > most) {
      if (!ranges_.empty()) ranges_.back().count = least[i] - ranges_.back().first;
      ranges_.push_back({i == 0 ? 0 : least[i], 0, {}, {}});
    }
    most = std::max(most, uint64_t{cells_.primitives[i].most});
    range_of_.push_back(ranges_.size() - 1);
    ranges_.back().primitives.push_back(i);
  }
  if (!ranges_.empty()) ranges_.back().count = cells_.point_count - ranges_.back().first;
}

const std::byte* GltfWriter::tuple(const Attribute& attribute, uint64_t point) const {
  const Array& array = *attribute.array;
  static constexpr std::array<std::byte, 16 * 8> zeros{};
  if (array.domain != Domain::corner) {
    const uint64_t old = cells_.old_point.empty() ? point : cells_.old_point[point];
    return array.bytes.data() + old * array.tuple_size();
  }
  const uint64_t corner = cells_.corner_of_point[point];
  return corner == GltfCells::no_corner ? zeros.data() : array.bytes.data() + corner * array.tuple_size();
}

/// Bounds as the standard wants them for positions, over finite values.
json GltfWriter::limits_of(const Attribute& attribute, const Range& range) const {
  std::array<double, 3> low, high;
  low.fill(INFINITY);
  high.fill(-INFINITY);
  const Scalar type = attribute.array->type;
  for (uint64_t p = range.first; p < range.first + range.count; ++p) {
    for (size_t k = 0; k < 3; ++k) {
      double value = number_at(tuple(attribute, p) + k * size_of(type), type);
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

void GltfWriter::add_accessors() {
  for (size_t a = 0; a < attributes_.size(); ++a) {
    const Attribute& attribute = attributes_[a];
    const size_t view = document_["bufferViews"].size();
    const uint64_t size = cells_.point_count * attribute.stride();
    document_["bufferViews"].push_back({{"buffer", 0},
                                        {"byteOffset", binary_size_},
                                        {"byteLength", size},
                                        {"byteStride", attribute.stride()},
                                        {"target", 34962}});
    binary_size_ += size;
    for (Range& range : ranges_) {
      const bool used = std::any_of(range.primitives.begin(), range.primitives.end(), [&](size_t i) {
        return mesh_.blocks.empty() || attribute.blocks[cells_.primitives[i].block];
      });
      range.accessors.push_back(used ? static_cast<int>(document_["accessors"].size()) : -1);
      if (!used) continue;
      json accessor = {{"bufferView", view},
                       {"byteOffset", range.first * attribute.stride()},
                       {"componentType", component_type_of(attribute.type)},
                       {"count", range.count},
                       {"type", shape_of(attribute.array->components)}};
      if (attribute.normalized) accessor["normalized"] = true;
      if (a == 0) accessor.update(limits_of(attribute, range));
      document_["accessors"].push_back(std::move(accessor));
    }
  }
}

/// 65535 itself means "restart" to graphics hardware and is not used.
bool is_short(const Range& range) {
  return range.count <= 65535;
}

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

/// "tree/0", "tree/1", ... become one mesh "tree"; other blocks a mesh each.
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

/// Nodes as the file had them that the mesh was read from, if its blocks are still the same.
bool GltfWriter::add_nodes_from_metadata(std::vector<std::vector<size_t>>& meshes) {
  const json nodes = parsed(mesh_, "gltf.nodes"), roots = parsed(mesh_, "gltf.scene"),
             blocks = parsed(mesh_, "gltf.meshes");
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
  json asset = parsed(mesh_, "gltf.asset");
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

void GltfWriter::put_attribute(BufferedWriter& out, const Attribute& attribute) const {
  const Array& array = *attribute.array;
  const size_t padding = attribute.stride() - attribute.tight_size();
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
        out.put_raw(static_cast<float>(number_at(from + k * size, array.type)));
      }
    }
    for (size_t k = 0; k < padding; ++k) out.put('\0');
  }
}

void GltfWriter::put_indices(BufferedWriter& out) const {
  for (size_t i = 0; i < cells_.primitives.size(); ++i) {
    const GltfPrimitive& primitive = cells_.primitives[i];
    const Range& range = ranges_[range_of_[i]];
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
  for (const Attribute& attribute : attributes_) put_attribute(out, attribute);
  put_indices(out);
}

Result<> GltfWriter::write_glb() {
  std::string text = document_.dump(-1, ' ', false, json::error_handler_t::replace);
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

}  // namespace

Result<std::vector<std::string>> write_gltf(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  const bool text = options.ascii || options.format == "gltf";
  return GltfWriter(mesh, sink, !text).write();
}

}  // namespace maille
