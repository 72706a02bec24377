#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <pugixml.hpp>
#include <set>

#include "base/result.h"
#include "io/budget.h"
#include "io/number_column.h"
#include "io/reading.h"
#include "io/threemf/threemf.h"
#include "io/zip.h"

namespace maille {
namespace {

/// The name of an element or attribute without the prefix of its namespace, which every file chooses itself.
std::string_view local_name(const char* name) {
  const char* const colon = std::strchr(name, ':');
  return colon == nullptr ? name : colon + 1;
}

pugi::xml_node child_of(pugi::xml_node node, std::string_view name) {
  return node.find_child([&](pugi::xml_node child) { return local_name(child.name()) == name; });
}

/// What stands in an attribute of an extension, such as p:path.
const char* extension_attribute(pugi::xml_node node, std::string_view name) {
  for (const pugi::xml_attribute attribute : node.attributes()) {
    if (std::strchr(attribute.name(), ':') != nullptr && local_name(attribute.name()) == name)
      return attribute.value();
  }
  return "";
}

std::string called(pugi::xml_node object) {
  return "object " + std::string(object.attribute("id").value()).substr(0, 20);
}

std::optional<uint32_t> index_in(pugi::xml_attribute attribute) {
  const char* const text = attribute.value();
  const char* const end = text + std::strlen(text);
  uint32_t value = 0;
  const auto [stop, error] = std::from_chars(text, end, value);
  return error == std::errc() && stop == end && stop != text ? std::optional(value) : std::nullopt;
}

/// A model in the package: the root, or one that components name (production extension).
struct ModelPart {
  std::vector<std::byte> text;  ///< the document's own memory
  pugi::xml_document document;
  pugi::xml_node model;
  std::map<uint32_t, pugi::xml_node> objects;
  std::map<uint32_t, std::pair<uint32_t, uint32_t>> materials;  ///< first label and number of them, by group
};

class ThreeMfReader {
 public:
  ThreeMfReader(const Source& source, const ReadOptions& options)
      : name_(source.name()), options_(options), left_(options.limits.mesh_bytes) {}

  Result<ReadResult> read(Bytes bytes);

 private:
  // Chosen, not swept. Slicers write one part for each object, and trees of two levels.
  static constexpr size_t most_parts = 1000, most_depth = 32, most_visits = 1 << 16;
  static constexpr uint32_t no_material = UINT32_MAX;

  /// One use of an object with a mesh by the build.
  struct Placed {
    size_t block = 0;
    GltfAffine transform;
  };

  std::string root_path(const ZipReader& zip);
  Result<ModelPart*> open_part(const ZipReader& zip, const std::string& path);
  Result<> list_resources(ModelPart& part);
  void list_materials(ModelPart& part, uint32_t id, pugi::xml_node group);
  Result<> place_items(const ZipReader& zip, ModelPart& root);
  Result<> place(const ZipReader& zip, ModelPart& part, uint32_t id, const GltfAffine& transform,
                 size_t depth);
  Result<GltfAffine> transform_of(pugi::xml_node node) const;
  Result<bool> read_meshes(bool wide);
  Result<bool> read_points(pugi::xml_node object, NumberColumn& points);
  Result<> read_triangles(const ModelPart& part, pugi::xml_node object, uint64_t first, uint64_t count);
  Result<uint32_t> material_of(const ModelPart& part, pugi::xml_node object, pugi::xml_node triangle) const;
  void look_for_others(pugi::xml_node triangle);
  Result<> add_metadata(pugi::xml_node model);
  void add_materials();
  void add_instances();
  void add_notes(const ZipReader& zip);
  void left_out(std::string_view what) {
    if (left_out_.size() < 8) left_out_.insert(std::string(what.substr(0, 40)));
  }
  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input, name_ + ": " + what);
  }

  std::string name_;
  const ReadOptions& options_;
  uint64_t left_;  ///< bytes that may still be unpacked
  std::map<std::string, ModelPart> parts_;
  std::vector<Placed> placed_;
  std::vector<std::pair<const ModelPart*, pugi::xml_node>> meshes_;  ///< of the blocks
  std::map<pugi::xml_node, size_t> block_of_;
  size_t visits_ = 0;
  std::vector<std::string> labels_, colours_;
  std::vector<uint32_t> material_;
  std::set<std::string> left_out_;
  ReadResult result_;
};

std::string ThreeMfReader::root_path(const ZipReader& zip) {
  const ZipEntry* const entry = zip.find("_rels/.rels");
  const auto text = entry == nullptr ? Result<std::vector<std::byte>>() : zip.read(*entry, 1 << 20);
  pugi::xml_document document;
  if (text && document.load_buffer(text->data(), text->size())) {
    for (const pugi::xml_node relation : child_of(document, "Relationships").children()) {
      const std::string path = relation.attribute("Target").value();
      if (std::strcmp(relation.attribute("Type").value(), threemf_relation) == 0 && zip.find(path) != nullptr)
        return path;
    }
  }
  return threemf_model_path;
}

Result<ModelPart*> ThreeMfReader::open_part(const ZipReader& zip, const std::string& path) {
  if (const auto found = parts_.find(path); found != parts_.end()) return &found->second;
  const ZipEntry* const entry = zip.find(path);
  if (entry == nullptr)
    return malformed("there is no \"" + path.substr(0, 100) + "\" in it, the model of a 3MF package");
  if (parts_.size() >= most_parts)
    return failure(ErrorCode::unsupported, name_ + ": it has more than 1000 models in files of their own");
  ModelPart& part = parts_[path];
  // A document takes up to 16 times the bytes of its text (an element of 4 bytes takes 64), points and
  // triangles less than the text.
  part.text = MAILLE_TRY(zip.read(*entry, left_ / 20));
  left_ -= 20 * part.text.size();
  const auto parsed = part.document.load_buffer_inplace(part.text.data(), part.text.size());
  if (!parsed) return malformed(path + ": not well-formed XML (" + parsed.description() + ")");
  part.model = child_of(part.document, "model");
  if (!part.model) return malformed(path + ": it has no element \"model\"");
  MAILLE_CHECK(list_resources(part));
  return &part;
}

Result<> ThreeMfReader::list_resources(ModelPart& part) {
  for (const pugi::xml_node node : child_of(part.model, "resources").children()) {
    const std::string_view kind = local_name(node.name());
    const auto id = index_in(node.attribute("id"));
    if (kind == "object" && id) {
      part.objects.emplace(*id, node);
    } else if (kind == "basematerials" && id) {
      list_materials(part, *id, node);
    } else if (kind == "object" || kind == "basematerials") {
      return malformed("a resource \"" + std::string(kind) + "\" has no number as its id");
    } else {
      left_out(kind);
    }
  }
  return {};
}

void ThreeMfReader::list_materials(ModelPart& part, uint32_t id, pugi::xml_node group) {
  const auto first = static_cast<uint32_t>(labels_.size());
  for (const pugi::xml_node base : group.children("base")) {
    labels_.emplace_back(base.attribute("name").value());
    colours_.emplace_back(base.attribute("displaycolor").value());
  }
  part.materials.emplace(id, std::pair(first, static_cast<uint32_t>(labels_.size()) - first));
}

Result<GltfAffine> ThreeMfReader::transform_of(pugi::xml_node node) const {
  const pugi::xml_attribute attribute = node.attribute("transform");
  GltfAffine transform;
  if (!attribute) return transform;
  const char* at = attribute.value();
  const char* const end = at + std::strlen(at);
  const auto skip_blanks = [&] {
    while (at != end && std::strchr(" \t\r\n", *at) != nullptr) ++at;
  };
  for (size_t i = 0; i < 12; ++i) {
    skip_blanks();
    Number number;
    at = at == end ? nullptr : parse_number(at, end, number);
    if (at == nullptr || !std::isfinite(number.value)) return malformed("a transform is not 12 numbers");
    threemf_number(transform, i) = number.value;
  }
  skip_blanks();
  if (at != end) return malformed("a transform is not 12 numbers");
  return transform;
}

Result<> ThreeMfReader::place_items(const ZipReader& zip, ModelPart& root) {
  for (const pugi::xml_node item : child_of(root.model, "build").children("item")) {
    const auto id = index_in(item.attribute("objectid"));
    if (!id) return malformed("an item of the build has no number as its objectid");
    const char* const path = extension_attribute(item, "path");
    ModelPart* const part = *path == 0 ? &root : MAILLE_TRY(open_part(zip, path));
    const GltfAffine transform = MAILLE_TRY(transform_of(item));
    MAILLE_CHECK(place(zip, *part, *id, transform, 0));
  }
  return {};
}

/// Goes down the tree of an object. Few bytes can name an object any number of times, in circles, too.
Result<> ThreeMfReader::place(const ZipReader& zip, ModelPart& part, uint32_t id, const GltfAffine& transform,
                              size_t depth) {
  const auto found = part.objects.find(id);
  if (found == part.objects.end()) return malformed("there is no object " + std::to_string(id));
  if (++visits_ > most_visits || depth > most_depth)
    return failure(ErrorCode::unsupported, name_ +
                                               ": its build has more than 65536 objects, or they are "
                                               "components of each other more than 32 times");
  const pugi::xml_node object = found->second;
  if (child_of(object, "mesh")) {
    const auto [block, first_use] = block_of_.emplace(object, meshes_.size());
    if (first_use) meshes_.emplace_back(&part, object);
    placed_.push_back({block->second, transform});
  }
  for (const pugi::xml_node component : child_of(object, "components").children("component")) {
    const auto inner = index_in(component.attribute("objectid"));
    if (!inner) return malformed("a component has no number as its objectid");
    const char* const path = extension_attribute(component, "path");
    ModelPart* const other = *path == 0 ? &part : MAILLE_TRY(open_part(zip, path));
    const auto own = MAILLE_TRY(transform_of(component));
    MAILLE_CHECK(place(zip, *other, *inner, transform * own, depth + 1));
  }
  return {};
}

Result<bool> ThreeMfReader::read_points(pugi::xml_node object, NumberColumn& points) {
  for (const pugi::xml_node vertex : child_of(child_of(object, "mesh"), "vertices").children("vertex")) {
    Number numbers[3];
    for (int i = 0; i < 3; ++i) {
      constexpr const char* names[] = {"x", "y", "z"};
      const char* const text = vertex.attribute(names[i]).value();
      const char* const end = text + std::strlen(text);
      if (text == end || parse_number(text, end, numbers[i]) != end) {
        return malformed(called(object) + ": a vertex has no number as its " + names[i]);
      }
    }
    if (!points.append(numbers)) return false;  // never of doubles
  }
  if (points.count() > max_points)
    return failure(ErrorCode::unsupported, name_ + ": it has 2^32 points or more");
  return true;
}

/// The label of a triangle: by its own group and index, or by those of its object.
Result<uint32_t> ThreeMfReader::material_of(const ModelPart& part, pugi::xml_node object,
                                            pugi::xml_node triangle) const {
  const pugi::xml_attribute own_group = triangle.attribute("pid"), own_index = triangle.attribute("p1");
  const auto group = index_in(own_group ? own_group : object.attribute("pid"));
  const auto found = group ? part.materials.find(*group) : part.materials.end();
  if (found == part.materials.end()) return no_material;  // none, or a group of an extension
  const pugi::xml_attribute index = own_index || own_group ? own_index : object.attribute("pindex");
  if (!index) return no_material;
  const auto [first, count] = found->second;
  const auto number = index_in(index);
  if (!number || *number >= count)
    return malformed("a triangle names base material \"" + std::string(index.value()).substr(0, 20) +
                     "\" of a group of " + std::to_string(count));
  return first + *number;
}

/// Attributes that slicers add, such as painted colours.
void ThreeMfReader::look_for_others(pugi::xml_node triangle) {
  for (const pugi::xml_attribute attribute : triangle.attributes()) {
    const std::string_view name = attribute.name();
    const bool corner = name == "v1" || name == "v2" || name == "v3";
    const bool property = name == "pid" || name == "p1" || name == "p2" || name == "p3";
    if (!corner && !property) left_out(local_name(attribute.name()));
  }
}

Result<> ThreeMfReader::read_triangles(const ModelPart& part, pugi::xml_node object, uint64_t first,
                                       uint64_t count) {
  CellBlock block;
  block.type = CellType::triangle;
  block.name = object.attribute("name").value();
  const pugi::xml_node mesh = child_of(object, "mesh");
  for (const pugi::xml_node triangle : child_of(mesh, "triangles").children("triangle")) {
    look_for_others(triangle);
    for (const char* corner : {"v1", "v2", "v3"}) {
      const auto index = index_in(triangle.attribute(corner));
      if (!index || *index >= count) {
        return malformed(called(object) + ": triangle " + std::to_string(block.connectivity.size() / 3) +
                         ": its " + corner + " is none of the " + counted(count, "vertex", "vertices"));
      }
      block.connectivity.push_back(static_cast<uint32_t>(first + *index));
    }
    material_.push_back(MAILLE_TRY(material_of(part, object, triangle)));
  }
  for (const pugi::xml_node other : mesh.children()) {
    const std::string_view kind = local_name(other.name());
    if (kind != "vertices" && kind != "triangles" && !kind.empty()) left_out(kind);
  }
  result_.mesh.blocks.push_back(std::move(block));
  return {};
}

/// False where a number needs a double, and all are to be read again.
Result<bool> ThreeMfReader::read_meshes(bool wide) {
  NumberColumn points(3, wide);
  result_.mesh.blocks.clear();
  material_.clear();
  for (const auto& [part, object] : meshes_) {
    const uint64_t first = points.count();
    const bool fits = MAILLE_TRY(read_points(object, points));
    if (!fits) return false;
    MAILLE_CHECK(read_triangles(*part, object, first, points.count() - first));
    MAILLE_CHECK(report_progress(
        options_.progress, "reading",
        static_cast<double>(result_.mesh.blocks.size()) / static_cast<double>(meshes_.size())));
  }
  result_.mesh.points = points.take("position", Domain::point, Role::none);
  return true;
}

Result<> ThreeMfReader::add_metadata(pugi::xml_node model) {
  const std::string unit = model.attribute("unit").value();
  // A model that says nothing counts in millimetres. Kept, since other formats do not know where a mesh came
  // from.
  result_.mesh.metadata.emplace_back("3mf.unit", unit.empty() ? "millimeter" : unit);
  if (!unit.empty() && unit != "millimeter")
    result_.notes.push_back("lengths are in the unit " + unit.substr(0, 20));
  CommentRoom room;
  for (const pugi::xml_node entry : model.children("metadata")) {
    const std::string key = entry.attribute("name").value(), value = entry.child_value();
    if (key.find(':') != std::string::npos) {
      left_out("metadata of a slicer");
    } else if (room.take(key + value)) {
      result_.mesh.metadata.emplace_back("3mf.metadata." + key, value);
    }
  }
  return room.check(name_);
}

void ThreeMfReader::add_materials() {
  const auto count = static_cast<uint32_t>(labels_.size());
  bool any = false, none = false;
  for (uint32_t& material : material_) {
    any |= material != no_material;
    none |= material == no_material;
    material = std::min(material, count);
  }
  if (!any) return;
  Array array = make_array("material", Domain::cell, Scalar::u32, 1, Role::label);
  const Bytes bytes = std::as_bytes(std::span(material_));
  array.bytes.assign(bytes.begin(), bytes.end());
  array.labels = labels_;
  if (none) array.labels.emplace_back();
  result_.mesh.arrays.push_back(std::move(array));
  std::string colours;
  for (const std::string& colour : colours_) colours += (colours.empty() ? "" : " ") + to_word(colour);
  result_.mesh.metadata.emplace_back("3mf.displaycolor", colours);
}

void ThreeMfReader::add_instances() {
  bool plain = placed_.size() == meshes_.size();
  for (const Placed& one : placed_) plain &= one.transform.is_identity();
  if (plain) return;
  nlohmann::ordered_json nodes = nlohmann::ordered_json::array(), scene = nodes, meshes = nodes;
  for (const Placed& one : placed_) {
    nlohmann::ordered_json node = {{"mesh", one.block}};
    if (const std::string& name = result_.mesh.blocks[one.block].name; !name.empty()) node["name"] = name;
    if (!one.transform.is_identity()) {
      auto& matrix = node["matrix"] = nlohmann::ordered_json::array();
      for (size_t i = 0; i < 12; ++i) {
        matrix.push_back(threemf_number(one.transform, i));
        if (i % 3 == 2) matrix.push_back(i == 11 ? 1 : 0);
      }
    }
    scene.push_back(nodes.size());
    nodes.push_back(std::move(node));
  }
  for (size_t i = 0; i < meshes_.size(); ++i) meshes.push_back({i});
  // A name that is not UTF-8 must not end in an exception.
  const auto text = [](const nlohmann::ordered_json& json) {
    return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  };
  for (const auto& [key, value] :
       {std::pair("gltf.nodes", &nodes), {"gltf.scene", &scene}, {"gltf.meshes", &meshes}})
    result_.mesh.metadata.emplace_back(key, text(*value));
  result_.notes.push_back("objects are as they are stored; how the build places " +
                          counted(placed_.size(), "object") + " is kept as metadata");
}

void ThreeMfReader::add_notes(const ZipReader& zip) {
  size_t unused = 0, files = 0;
  for (const auto& [path, part] : parts_) {
    for (const auto& [id, object] : part.objects) {
      if (child_of(object, "mesh") && block_of_.count(object) == 0) ++unused;
    }
  }
  for (const ZipEntry& entry : zip.entries()) {
    const bool own = entry.path.ends_with(".rels") || entry.path == "[Content_Types].xml" ||
                     entry.path.ends_with("/") || entry.path.ends_with(".model");
    files += own ? 0 : 1;
  }
  if (unused != 0)
    result_.notes.push_back(counted(unused, "object") + " that the build does not use left out");
  if (!left_out_.empty()) {
    std::string list;
    for (const std::string& what : left_out_) list += (list.empty() ? "" : ", ") + what;
    result_.notes.push_back("what extensions of 3MF or a slicer added left out: " + list);
  }
  if (files != 0)
    result_.notes.push_back(counted(files, "other file") + " of the package (pictures, settings) left out");
}

Result<ReadResult> ThreeMfReader::read(Bytes bytes) {
  const ZipReader zip = MAILLE_TRY(ZipReader::open(bytes, name_));
  ModelPart* const root = MAILLE_TRY(open_part(zip, root_path(zip)));
  MAILLE_CHECK(place_items(zip, *root));
  const bool single = MAILLE_TRY(read_meshes(false));
  if (!single) MAILLE_CHECK(read_meshes(true));
  MAILLE_CHECK(add_metadata(root->model));
  add_materials();
  add_instances();
  add_notes(zip);
  return std::move(result_);
}

}  // namespace

Result<ReadResult> read_threemf(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  return ThreeMfReader(source, options).read(input.bytes());
}

}  // namespace maille
