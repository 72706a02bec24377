#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "base/bytes.h"
#include "io/gltf/gltf_file.h"
#include "io/gltf/gltf_names.h"
#include "io/gltf/gltf_writer.h"
#include "io/reading.h"
#include "numbers/number_map.h"

namespace maille {

using json = GltfWriter::Json;

json gltf_metadata(const Mesh& mesh, const char* key) {
  for (const auto& [name, value] : mesh.metadata) {
    if (name == key) return json_too_deep(value) ? json() : json::parse(value, nullptr, false);
  }
  return json();
}

const char* gltf_shape_of(uint32_t components) {
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

std::set<std::string> GltfWriter::names_in(const char* key) const {
  std::set<std::string> names;
  const json list = gltf_metadata(mesh_, key);
  if (!list.is_array()) return names;
  for (const json& name : list) {
    if (name.is_string()) names.insert(name.get<std::string>());
  }
  return names;
}

/// The type in which an array is written: attributes are 8 or 16 bit integers or 32 bit floats. What is lost
/// is counted, and the largest error is told.
Scalar GltfWriter::type_written(const Array& array) {
  if (array.type == Scalar::f32 || size_of(array.type) <= 2) return array.type;
  uint64_t rounded = 0;
  double worst = 0;
  const size_t size = size_of(array.type);
  for (size_t at = 0; at < array.bytes.size(); at += size) {
    const double value = number_as_double(array.type, array.bytes.data() + at);
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
  GltfAttribute position;
  position.semantic = "POSITION";
  position.array = &mesh_.points;
  position.type = type_written(mesh_.points);
  position.normalized = normalized_.count("position") != 0 && !is_float(position.type);
  position.blocks.assign(mesh_.blocks.size(), true);
  quantized_ = !is_float(position.type);
  attributes_.push_back(std::move(position));
}

/// glTF's name for an array by its meaning and shape, or one of its own behind an underscore, as the standard
/// wants of other names.
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
  for (const GltfAttribute& other : attributes_) {
    if (other.semantic != semantic) continue;
    for (size_t b = 0; b < blocks.size(); ++b) {
      if (blocks[b] && other.blocks[b]) return true;
    }
    if (blocks.empty()) return true;
  }
  return false;
}

/// The next number, or an own name, that no array of the same primitives has. Ends: there are fewer arrays
/// than numbers.
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

/// Normals of length 1, as glTF wants them; OBJ files have others. Those of length 0 have no direction and
/// stay, and so do normals that were in a glTF file before.
const Array& GltfWriter::with_unit_length(const Array& normals) {
  // The deviation that counts as length 1. 8 bits round by 1/256 = 0.0039, so normals that came from them are
  // left alone.
  constexpr double tolerance = 0.005;  // 8 bits round by 0.0039
  const auto& metadata = mesh_.metadata;
  const bool was_gltf = std::any_of(metadata.begin(), metadata.end(),
                                    [](const auto& entry) { return entry.first.starts_with("gltf."); });
  if (was_gltf || normals.type != Scalar::f32) return normals;
  Array unit = normals;
  uint64_t changed = 0;
  for (size_t i = 0; i < unit.count(); ++i) {
    const auto normal = unit.values<float>().subspan(3 * i, 3);
    double squares = 0;
    for (const float x : normal) squares += static_cast<double>(x) * static_cast<double>(x);
    const double length = std::sqrt(squares);
    if (!(length > 0) || !std::isfinite(length) || std::fabs(length - 1) <= tolerance) continue;
    for (float& x : normal) x = static_cast<float>(static_cast<double>(x) / length);
    ++changed;
  }
  if (changed == 0) return normals;
  notes_.push_back(counted(changed, "normal") +
                   " made as long as glTF wants them (1): their lengths are lost");
  return made_.emplace_back(std::move(unit));
}

void GltfWriter::plan_attribute(const Array& array, const json& only) {
  if (!gltf_shape_of(array.components) ||
      (array.components > 4 && array.type != Scalar::f32 && size_of(array.type) <= 2)) {
    notes_.push_back("array \"" + array.name + "\" left out: glTF has no " +
                     std::to_string(array.components) + " components of " + name_of(array.type));
    return;
  }
  GltfAttribute attribute;
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
  if (attribute.semantic == "NORMAL") attribute.array = &with_unit_length(array);
  const bool integers = !is_float(attribute.type);
  const std::string& semantic = attribute.semantic;
  const bool fractions = semantic.starts_with("COLOR_") || semantic.starts_with("WEIGHTS_") ||
                         semantic == "NORMAL" || semantic == "TANGENT";
  attribute.normalized = integers && (fractions || normalized_.count(array.name) != 0);
  // What the standard allows as integers without the extension for quantised meshes.
  const bool core = semantic[0] == '_' || semantic.starts_with("COLOR_") ||
                    semantic.starts_with("WEIGHTS_") || semantic.starts_with("JOINTS_") ||
                    (semantic.starts_with("TEXCOORD_") && attribute.normalized &&
                     (attribute.type == Scalar::u8 || attribute.type == Scalar::u16));
  quantized_ = quantized_ || (integers && !core);
  attributes_.push_back(std::move(attribute));
}

void GltfWriter::plan_attributes() {
  plan_positions();
  const json only = gltf_metadata(mesh_, "gltf.only");
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
  // least[i]: the least point that primitive i or a later one uses.
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

}  // namespace maille
