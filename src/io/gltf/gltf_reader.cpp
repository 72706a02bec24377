#include <maille/gltf.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "base/bytes.h"
#include "io/budget.h"
#include "io/buffered_writer.h"
#include "io/gltf/gltf.h"
#include "io/gltf/gltf_accessors.h"
#include "io/gltf/gltf_document.h"
#include "io/gltf/gltf_names.h"

namespace maille {
namespace {

using nlohmann::json;

/// Primitives over the same points, which are in the mesh once.
struct Group {
  std::map<std::string, int> attributes;  ///< accessors; with POSITION
  uint64_t first = 0, count = 0;          ///< points
};

struct Part {
  std::string name;
  size_t mesh = 0;
  const tinygltf::Primitive* primitive = nullptr;
  size_t group = 0;
  std::string where;  ///< for messages
};

std::vector<std::string> files_of(const GltfFile& file) {
  std::vector<std::string> paths;
  for (const auto& source : file.files) paths.push_back(source->name());
  return paths;
}

/// Reads the meshes of the default scene, one block for each primitive. Points of groups are one after the
/// other; each attribute is an array over all points, zero where a group does not have it. Metadata keep what
/// nodes say, from which the writer makes the scene again.
class GltfReader {
 public:
  GltfReader(GltfFile file, tinygltf::Model model, const ReadOptions& options)
      : file_(std::move(file)),
        model_(std::move(model)),
        accessors_(file_, model_),
        options_(options),
        budget_(file_.name, file_.total_bytes, options.limits) {}

  Result<ReadResult> read();

 private:
  Result<> walk_scene();
  Result<> visit_node(int index, std::vector<int>& open);
  Result<> collect_parts();
  Result<> collect_part(size_t mesh, size_t number);
  size_t group_for(const tinygltf::Primitive& primitive);
  Result<> read_points();
  Result<> read_attributes();
  Result<> read_attribute(Group& group, const std::string& semantic, int index);
  Array& array_for(const std::string& semantic, const GltfLayout& layout);
  Result<> read_cells(const Part& part);
  Result<std::vector<uint32_t>> read_indices(const Part& part);
  Result<> read_materials();
  void note_partial_arrays();
  uint64_t node_names_lost() const;
  void keep_metadata();
  tl::unexpected<Error> malformed(const std::string& what) const { return accessors_.malformed(what); }

  GltfFile file_;
  tinygltf::Model model_;
  GltfAccessors accessors_;
  const ReadOptions& options_;
  Budget budget_;
  Mesh mesh_;
  std::vector<std::string> notes_;

  std::vector<uint64_t> uses_;  ///< of each mesh in the scene
  std::vector<bool> visited_;   ///< nodes
  bool moved_ = false;  ///< some node is not at the origin, or nodes say more than which meshes to draw
  std::vector<int> roots_;
  std::vector<Part> parts_;
  std::vector<Group> groups_;
  std::map<int, size_t> latest_group_;                            ///< by accessor of the positions
  std::map<std::pair<std::string, std::string>, size_t> arrays_;  ///< by semantic and type
  std::map<std::string, std::set<size_t>> owners_;                ///< groups that have an array, by its name
  std::set<std::string> normalized_;
};

bool is_identity(const tinygltf::Node& node) {
  static const std::vector<double> unit = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  const auto is = [](const std::vector<double>& values, const std::vector<double>& nothing) {
    return values.empty() || values == nothing;
  };
  return is(node.matrix, unit) && is(node.translation, {0, 0, 0}) && is(node.rotation, {0, 0, 0, 1}) &&
         is(node.scale, {1, 1, 1});
}

Result<> GltfReader::visit_node(int index, std::vector<int>& open) {
  if (index < 0 || static_cast<size_t>(index) >= model_.nodes.size()) {
    return malformed("the scene uses node " + std::to_string(index) + ", but there are " +
                     std::to_string(model_.nodes.size()));
  }
  const auto i = static_cast<size_t>(index);
  // So cycles end, and so do trees whose nodes have several parents.
  if (visited_[i]) {  // not allowed, but it changes nothing here
    moved_ = true;
    return {};
  }
  visited_[i] = true;
  const tinygltf::Node& node = model_.nodes[i];
  moved_ = moved_ || !is_identity(node) || !node.extensions.empty();
  open.insert(open.end(), node.children.begin(), node.children.end());
  if (node.mesh == -1) return {};
  if (node.mesh < 0 || static_cast<size_t>(node.mesh) >= model_.meshes.size()) {
    return malformed("node " + std::to_string(i) + " uses mesh " + std::to_string(node.mesh) +
                     ", but there are " + std::to_string(model_.meshes.size()));
  }
  ++uses_[static_cast<size_t>(node.mesh)];
  return {};
}

/// Finds the meshes of the default scene; without scenes, all meshes. With a list of open nodes instead of
/// recursion, so that no depth of the tree is too much.
Result<> GltfReader::walk_scene() {
  uses_.assign(model_.meshes.size(), model_.scenes.empty() ? 1 : 0);
  visited_.assign(model_.nodes.size(), false);
  if (model_.scenes.empty()) return {};
  // Without a default the first scene is read: the standard leaves it to the reader.
  const int scene = std::max(model_.defaultScene, 0);
  if (static_cast<size_t>(scene) >= model_.scenes.size()) {
    return malformed("the default scene is " + std::to_string(scene) + ", but there are " +
                     std::to_string(model_.scenes.size()));
  }
  roots_ = model_.scenes[static_cast<size_t>(scene)].nodes;
  std::vector<int> open(roots_.rbegin(), roots_.rend());
  while (!open.empty()) {
    const int node = open.back();
    open.pop_back();
    MAILLE_CHECK(visit_node(node, open));
  }
  const auto unused = std::count(uses_.begin(), uses_.end(), 0u);
  if (unused != 0) {
    notes_.push_back(counted(static_cast<uint64_t>(unused), "mesh", "meshes") +
                     " outside of the default scene left out");
  }
  const auto repeated = std::count_if(uses_.begin(), uses_.end(), [](uint64_t uses) { return uses > 1; });
  if (repeated != 0) {
    moved_ = true;
    notes_.push_back(counted(static_cast<uint64_t>(repeated), "mesh", "meshes") +
                     " used by several nodes: read once, the nodes are kept as metadata");
  } else if (moved_) {
    notes_.push_back("nodes have transforms, which are kept as metadata");
  }
  return {};
}

/// The group of a primitive: those with the same positions share points as long as they agree on all other
/// attributes, too. Only the latest group with these positions is looked at, so that the time for many
/// primitives stays linear.
size_t GltfReader::group_for(const tinygltf::Primitive& primitive) {
  const int position = primitive.attributes.at("POSITION");
  const auto latest = latest_group_.find(position);
  if (latest != latest_group_.end()) {
    std::map<std::string, int>& have = groups_[latest->second].attributes;
    const bool agrees =
        std::all_of(primitive.attributes.begin(), primitive.attributes.end(), [&](const auto& wanted) {
          const auto found = have.find(wanted.first);
          return found == have.end() || found->second == wanted.second;
        });
    if (agrees) {
      have.insert(primitive.attributes.begin(), primitive.attributes.end());
      return latest->second;
    }
  }
  latest_group_[position] = groups_.size();
  groups_.push_back({primitive.attributes, 0, 0});
  return groups_.size() - 1;
}

Result<> GltfReader::collect_part(size_t m, size_t number) {
  const tinygltf::Mesh& mesh = model_.meshes[m];
  const tinygltf::Primitive& primitive = mesh.primitives[number];
  Part part;
  part.mesh = m;
  part.primitive = &primitive;
  part.name = mesh.primitives.size() == 1 ? mesh.name : mesh.name + "/" + std::to_string(number);
  part.where = "mesh " + std::to_string(m) + ", primitive " + std::to_string(number);
  if (primitive.extensions.count("KHR_draco_mesh_compression") != 0 &&
      primitive.attributes.count("POSITION") != 0) {
    const auto position = MAILLE_TRY(accessors_.get(primitive.attributes.at("POSITION"), part.where));
    if (position->bufferView < 0) {
      return failure(ErrorCode::unsupported,
                     file_.name + ": " + part.where +
                         " is compressed by KHR_draco_mesh_compression, which cannot be "
                         "read here; decompress it first, e.g. with \"gltf-transform copy\"");
    }
  }
  if (primitive.attributes.count("POSITION") == 0) {
    notes_.push_back(part.where + " has no positions and was left out");
    return {};
  }
  if (!primitive.targets.empty()) notes_.push_back(part.where + ": morph targets left out");
  part.group = group_for(primitive);
  parts_.push_back(std::move(part));
  return {};
}

Result<> GltfReader::collect_parts() {
  for (size_t m = 0; m < model_.meshes.size(); ++m) {
    if (uses_[m] == 0) continue;
    for (size_t p = 0; p < model_.meshes[m].primitives.size(); ++p) MAILLE_CHECK(collect_part(m, p));
  }
  return {};
}

/// Copies integers or floats into floats.
void widen(const GltfLayout& layout, std::span<const std::byte> from, std::byte* to) {
  const size_t size = size_of(layout.type);
  for (size_t i = 0; i * size < from.size(); ++i) {
    const float value = with_type(layout.type, [&](auto zero) {
      return static_cast<float>(load<decltype(zero)>(from.data() + i * size));
    });
    store(to + i * sizeof value, value);
  }
}

Result<> GltfReader::read_points() {
  // Two passes: the first takes all of it from the budget before anything is reserved, and finds out which
  // type holds all positions.
  std::vector<GltfLayout> layouts;
  uint64_t total = 0;
  for (Group& group : groups_) {
    const int index = group.attributes.at("POSITION");
    const std::string where = "accessor " + std::to_string(index) + " (POSITION)";
    const auto accessor = MAILLE_TRY(accessors_.get(index, "a primitive"));
    layouts.push_back(MAILLE_TRY(accessors_.layout(*accessor, where)));
    if (layouts.back().rows != 3 || layouts.back().columns != 1) return malformed(where + " is not VEC3");
    if (layouts.back().normalized != layouts.front().normalized) {
      return failure(ErrorCode::unsupported,
                     file_.name + ": some positions are normalized integers, some are not");
    }
    if (accessor->count > max_points - total) return malformed("there are 2^32 points or more");
    group.first = total;
    group.count = accessor->count;
    MAILLE_CHECK(budget_.take(group.count, layouts.back().tuple_size()));
    total += group.count;
  }
  const bool same = std::all_of(layouts.begin(), layouts.end(),
                                [&](const GltfLayout& layout) { return layout.type == layouts[0].type; });
  if (!same) notes_.push_back("positions have different number types; all are now f32");
  mesh_.points.type = same && !layouts.empty() ? layouts[0].type : Scalar::f32;
  if (!layouts.empty() && layouts[0].normalized) normalized_.insert("position");
  for (size_t g = 0; g < groups_.size(); ++g) {
    const int index = groups_[g].attributes.at("POSITION");
    const std::string where = "accessor " + std::to_string(index) + " (POSITION)";
    std::vector<std::byte> bytes(groups_[g].count * layouts[g].tuple_size());
    MAILLE_CHECK(accessors_.read(*MAILLE_TRY(accessors_.get(index, where)), layouts[g], where, bytes));
    const size_t at = mesh_.points.bytes.size();
    mesh_.points.bytes.resize(at + groups_[g].count * mesh_.points.tuple_size());
    if (same) {
      std::copy(bytes.begin(), bytes.end(), mesh_.points.bytes.begin() + static_cast<ptrdiff_t>(at));
    } else {
      widen(layouts[g], bytes, mesh_.points.bytes.data() + at);
    }
  }
  return {};
}

Array& GltfReader::array_for(const std::string& semantic, const GltfLayout& layout) {
  const std::string type = std::string(name_of(layout.type)) + "x" + std::to_string(layout.components()) +
                           (layout.normalized ? "n" : "");
  const auto known = arrays_.find({semantic, type});
  if (known != arrays_.end()) return mesh_.arrays[known->second];
  auto [name, role] = name_of_gltf(semantic);
  // The same attribute in another type: an array of its own, or values would change.
  if (mesh_.find(name, Domain::point)) name += "." + type;
  arrays_[{semantic, type}] = mesh_.arrays.size();
  if (layout.normalized) normalized_.insert(name);
  mesh_.arrays.push_back(make_array(name, Domain::point, layout.type, layout.components(), role));
  return mesh_.arrays.back();
}

Result<> GltfReader::read_attribute(Group& group, const std::string& semantic, int index) {
  const std::string where = "accessor " + std::to_string(index) + " (" + semantic + ")";
  const auto accessor = MAILLE_TRY(accessors_.get(index, "attribute " + semantic));
  const GltfLayout layout = MAILLE_TRY(accessors_.layout(*accessor, where));
  if (accessor->count != group.count) {
    return malformed(where + " has " + std::to_string(accessor->count) + " elements for " +
                     std::to_string(group.count) + " positions");
  }
  Array& array = array_for(semantic, layout);
  if (array.bytes.empty()) {
    MAILLE_CHECK(budget_.take(mesh_.point_count(), array.tuple_size()));
    array.resize(mesh_.point_count());
  }
  owners_[array.name].insert(static_cast<size_t>(&group - groups_.data()));
  const std::span<std::byte> all(array.bytes);
  return accessors_.read(*accessor, layout, where,
                         all.subspan(group.first * array.tuple_size(), group.count * array.tuple_size()));
}

Result<> GltfReader::read_attributes() {
  for (const bool standard : {true, false}) {  // the arrays everybody knows come first
    for (Group& group : groups_) {
      for (const auto& [semantic, index] : group.attributes) {
        if (semantic == "POSITION" || (semantic[0] != '_') != standard) continue;
        MAILLE_CHECK(read_attribute(group, semantic, index));
      }
    }
  }
  return {};
}

/// The points of a primitive's corners, as numbers in the mesh.
Result<std::vector<uint32_t>> GltfReader::read_indices(const Part& part) {
  const Group& group = groups_[part.group];
  std::vector<uint32_t> points;
  if (part.primitive->indices < 0) {
    MAILLE_CHECK(budget_.take(group.count, sizeof(uint32_t)));
    points.resize(group.count);
    for (uint64_t i = 0; i < group.count; ++i) points[i] = static_cast<uint32_t>(group.first + i);
    return points;
  }
  const std::string where = part.where + ", indices";
  const auto accessor = MAILLE_TRY(accessors_.get(part.primitive->indices, where));
  const GltfLayout layout = MAILLE_TRY(accessors_.layout(*accessor, where));
  if (layout.components() != 1 ||
      (layout.type != Scalar::u8 && layout.type != Scalar::u16 && layout.type != Scalar::u32)) {
    return malformed(where + " are not unsigned integers");
  }
  // An accessor without a buffer view costs no bytes of the file, so its claimed count is held against the
  // budget.
  MAILLE_CHECK(budget_.take(accessor->count, sizeof(uint32_t) + size_of(layout.type)));
  std::vector<std::byte> bytes(accessor->count * layout.tuple_size());
  MAILLE_CHECK(accessors_.read(*accessor, layout, where, bytes));
  points.reserve(accessor->count);
  for (uint64_t i = 0; i < accessor->count; ++i) {
    const auto index = with_type(layout.type, [&](auto zero) {
      return static_cast<uint64_t>(load<decltype(zero)>(bytes.data() + i * sizeof zero));
    });
    if (index >= group.count) {
      return malformed(where + ": index " + std::to_string(i) + " is vertex " + std::to_string(index) +
                       ", but there are " + std::to_string(group.count));
    }
    points.push_back(static_cast<uint32_t>(group.first + index));
  }
  return points;
}

/// Triangles of a strip or fan, in the order and orientation of the standard (glTF 2.0, 3.7.2.1).
std::vector<uint32_t> triangles_of(const std::vector<uint32_t>& points, bool strip) {
  std::vector<uint32_t> triangles;
  for (size_t i = 0; i + 2 < points.size(); ++i) {
    if (strip) {
      triangles.insert(triangles.end(), {points[i], points[i + 1 + i % 2], points[i + 2 - i % 2]});
    } else {
      triangles.insert(triangles.end(), {points[i + 1], points[i + 2], points[0]});
    }
  }
  return triangles;
}

Result<> GltfReader::read_cells(const Part& part) {
  std::vector<uint32_t> points = MAILLE_TRY(read_indices(part));
  const int mode = part.primitive->mode;
  CellBlock block;
  block.name = part.name;
  const bool list =
      mode == TINYGLTF_MODE_POINTS || mode == TINYGLTF_MODE_LINE || mode == TINYGLTF_MODE_TRIANGLES;
  if (list) {
    block.type = mode == TINYGLTF_MODE_POINTS ? CellType::vertex
                 : mode == TINYGLTF_MODE_LINE ? CellType::line
                                              : CellType::triangle;
    if (points.size() % nodes_of(block.type) != 0) {
      return malformed(part.where + ": " + std::to_string(points.size()) +
                       " indices are no whole number of " + name_of(block.type) + "s");
    }
  } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP || mode == TINYGLTF_MODE_TRIANGLE_FAN) {
    block.type = CellType::triangle;
    MAILLE_CHECK(budget_.take(points.size(), 3 * sizeof(uint32_t)));
    points = triangles_of(points, mode == TINYGLTF_MODE_TRIANGLE_STRIP);
    notes_.push_back(part.where + ": a strip or fan was split into triangles");
  } else if (mode == TINYGLTF_MODE_LINE_STRIP || mode == TINYGLTF_MODE_LINE_LOOP) {
    block.type = CellType::poly_line;
    if (mode == TINYGLTF_MODE_LINE_LOOP && !points.empty()) points.push_back(points[0]);
    block.offsets = {0, points.size()};
  } else {
    return malformed(part.where + " has the unknown mode " + std::to_string(mode));
  }
  block.connectivity = std::move(points);
  mesh_.blocks.push_back(std::move(block));
  return {};
}

Result<> GltfReader::read_materials() {
  const bool any = std::any_of(parts_.begin(), parts_.end(),
                               [](const Part& part) { return part.primitive->material >= 0; });
  if (!any) return {};
  Array array = make_array("material", Domain::cell, Scalar::u32, 1, Role::label);
  array.labels = file_.materials;
  for (size_t i = 0; i < array.labels.size(); ++i) {
    if (array.labels[i].empty()) array.labels[i] = "material " + std::to_string(i);
  }
  const auto none = static_cast<uint32_t>(array.labels.size());
  bool some_without = false;
  MAILLE_CHECK(budget_.take(mesh_.cell_count(), sizeof(uint32_t)));
  for (size_t p = 0; p < parts_.size(); ++p) {
    const int material = parts_[p].primitive->material;
    if (material >= 0 && static_cast<size_t>(material) >= file_.materials.size()) {
      return malformed(parts_[p].where + " uses material " + std::to_string(material) + ", but there are " +
                       std::to_string(file_.materials.size()));
    }
    some_without = some_without || material < 0;
    const uint64_t first = array.count();
    array.resize(first + mesh_.blocks[p].size());
    const auto values = array.values<uint32_t>().subspan(first);
    std::fill(values.begin(), values.end(), material < 0 ? none : static_cast<uint32_t>(material));
  }
  if (some_without) array.labels.push_back("");
  mesh_.arrays.push_back(std::move(array));
  return {};
}

void GltfReader::note_partial_arrays() {
  json only = json::object();
  for (const auto& [semantic_and_type, index] : arrays_) {
    const std::string& name = mesh_.arrays[index].name;
    const std::string& semantic = semantic_and_type.first;
    json blocks = json::array();
    for (size_t p = 0; p < parts_.size(); ++p) {
      const bool has =
          parts_[p].primitive->attributes.count(semantic) != 0 && owners_[name].count(parts_[p].group) != 0;
      if (has) blocks.push_back(p);
    }
    if (blocks.size() == parts_.size()) continue;
    notes_.push_back(std::to_string(blocks.size()) + " of " + std::to_string(parts_.size()) +
                     " primitives have the array \"" + name +
                     "\"; the others have zeros here, and none in glTF");
    only[name] = std::move(blocks);
  }
  if (!only.empty()) mesh_.metadata.emplace_back("gltf.only", only.dump());
}

/// Where nodes are not kept: names that are not those of their meshes, as blocks have these.
uint64_t GltfReader::node_names_lost() const {
  uint64_t lost = 0;
  for (size_t i = 0; !moved_ && i < model_.nodes.size(); ++i) {
    const tinygltf::Node& node = model_.nodes[i];
    const bool of_mesh = node.mesh >= 0 && static_cast<size_t>(node.mesh) < model_.meshes.size() &&
                         model_.meshes[static_cast<size_t>(node.mesh)].name == node.name;
    lost += visited_[i] && !node.name.empty() && !of_mesh ? 1 : 0;
  }
  return lost;
}

void GltfReader::keep_metadata() {
  mesh_.metadata = std::move(file_.metadata);
  if (!file_.asset.empty()) mesh_.metadata.emplace_back("gltf.asset", file_.asset);
  if (!normalized_.empty()) mesh_.metadata.emplace_back("gltf.normalized", json(normalized_).dump());
  note_partial_arrays();
  if (moved_) {
    json meshes = json::array();
    for (size_t m = 0; m < model_.meshes.size(); ++m) meshes.push_back(json::array());
    for (size_t p = 0; p < parts_.size(); ++p) meshes[parts_[p].mesh].push_back(p);
    mesh_.metadata.emplace_back("gltf.nodes", file_.nodes);
    mesh_.metadata.emplace_back("gltf.scene", json(roots_).dump());
    mesh_.metadata.emplace_back("gltf.meshes", meshes.dump());
  }
  std::string left_out = file_.left_out;
  const auto add = [&](const std::string& what) { left_out += (left_out.empty() ? "" : ", ") + what; };
  if (!file_.materials.empty()) add("all of materials but their names");
  if (const uint64_t names = node_names_lost(); names != 0) add("the names of " + counted(names, "node"));
  if (!model_.scenes.empty() &&
      !model_.scenes[static_cast<size_t>(std::max(model_.defaultScene, 0))].name.empty())
    add("the name of the scene");
  std::set<std::string> extensions;
  for (const Part& part : parts_) {
    for (const auto& [name, value] : part.primitive->extensions) {
      if (!name.starts_with("MAILLE_")) extensions.insert(name);  // ours is decoded
    }
  }
  if (!extensions.empty())
    add(counted(extensions.size(), "extension") + " of primitives, such as " + *extensions.begin());
  if (!left_out.empty()) notes_.push_back("not part of the mesh, left out: " + left_out);
}

Result<ReadResult> GltfReader::read() {
  MAILLE_CHECK(walk_scene());
  MAILLE_CHECK(collect_parts());
  MAILLE_CHECK(read_points());
  MAILLE_CHECK(report_progress(options_.progress, "reading", 0.3));
  MAILLE_CHECK(read_attributes());
  MAILLE_CHECK(report_progress(options_.progress, "reading", 0.7));
  for (const Part& part : parts_) MAILLE_CHECK(read_cells(part));
  MAILLE_CHECK(read_materials());
  keep_metadata();
  MAILLE_CHECK(validate(mesh_));
  return ReadResult{std::move(mesh_), std::move(notes_), files_of(file_)};
}

}  // namespace

Result<ReadResult> read_gltf(const Source& source, const ReadOptions& options) {
  GltfFile file = MAILLE_TRY(open_gltf(source, gltf_extension));
  // The plain asset is made in memory, with the caller's limits, and read as any other. It does not use the
  // extension, so there is no further round.
  if (file.compressed) {
    std::vector<std::byte> plain;
    const auto sink = memory_sink(plain);
    MAILLE_CHECK(decompress_gltf(source, *sink, {.limits = options.limits}));
    ReadResult result = MAILLE_TRY(read_gltf(*memory_source(std::move(plain), source.name()), options));
    result.files_beside = files_of(file);
    return result;
  }
  tinygltf::Model model = MAILLE_TRY(load_gltf_model(file));
  return GltfReader(std::move(file), std::move(model), options).read();
}

}  // namespace maille
