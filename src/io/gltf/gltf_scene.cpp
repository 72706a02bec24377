// Meshes as the scene of a glTF file shows them: what nodes say, applied. For formats that have no nodes.
#include <maille/gltf.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/sort_unique.h"
#include "io/gltf/gltf_scene.h"
#include "io/gltf/gltf_writer.h"
#include "io/reading.h"
#include "mesh/empty_like.h"
#include "numbers/number_map.h"

namespace maille {
namespace {

using json = nlohmann::ordered_json;

/// So many numbers of a member, or the others where there are none or something else.
template <size_t size>
std::array<double, size> numbers_of(const json& node, const char* key, std::array<double, size> others) {
  const auto found = node.find(key);
  if (found == node.end() || !found->is_array() || found->size() != size) return others;
  for (size_t i = 0; i < size; ++i) {
    if (!(*found)[i].is_number()) return others;
    others[i] = (*found)[i].template get<double>();
  }
  return others;
}

GltfAffine transform_of(const json& node) {
  GltfAffine affine;
  if (node.contains("matrix")) {  // column after column
    const auto m = numbers_of<16>(node, "matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    for (size_t i = 0; i < 3; ++i) {
      for (size_t k = 0; k < 4; ++k) affine.m[i][k] = m[4 * k + i];
    }
    return affine;
  }
  const auto t = numbers_of<3>(node, "translation", {0, 0, 0});
  const auto [x, y, z, w] = numbers_of<4>(node, "rotation", {0, 0, 0, 1});
  const auto s = numbers_of<3>(node, "scale", {1, 1, 1});
  // The rotation by a unit quaternion, as in glTF 2.0, 3.5.3: the map is translation * rotation * scale.
  const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                          {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                          {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k) affine.m[i][k] = r[i][k] * s[k];
    affine.m[i][3] = t[i];
  }
  return affine;
}

std::vector<size_t> indices_of(const json& list, size_t limit) {
  std::vector<size_t> indices;
  if (!list.is_array()) return indices;
  for (const json& one : list) {
    if (one.is_number_unsigned() && one.get<uint64_t>() < limit) indices.push_back(one.get<size_t>());
  }
  return indices;
}

/// Instances in the order of the tree; each node once, whatever the file says, so cycles end.
std::vector<GltfInstance> instances_of(const json& nodes, const json& roots, size_t meshes) {
  std::vector<GltfInstance> instances;
  std::vector<bool> visited(nodes.size());
  std::vector<std::pair<size_t, GltfAffine>> open;
  const auto push = [&](const std::vector<size_t>& children, const GltfAffine& parent) {
    for (auto child = children.rbegin(); child != children.rend(); ++child) open.emplace_back(*child, parent);
  };
  push(indices_of(roots, nodes.size()), {});
  while (!open.empty()) {
    const auto [number, parent] = open.back();
    open.pop_back();
    const json& node = nodes[number];
    if (visited[number] || !node.is_object()) continue;
    visited[number] = true;
    const GltfAffine here = parent * transform_of(node);
    if (node.contains("children")) push(indices_of(node["children"], nodes.size()), here);
    if (!node.contains("mesh") || !node["mesh"].is_number_unsigned()) continue;
    const auto mesh = node["mesh"].get<uint64_t>();
    if (mesh >= meshes) continue;
    const bool named = node.contains("name") && node["name"].is_string();
    // Joints move a skinned mesh, whatever its own node says (glTF 2.0, 3.7.3.2).
    instances.push_back({static_cast<size_t>(mesh), node.contains("skin") ? GltfAffine() : here,
                         named ? node["name"].get<std::string>() : ""});
  }
  return instances;
}

/// Writes each instance's blocks one after the other, with points of its own. Metadata of nodes are dropped,
/// as they are applied.
class SceneMaker {
 public:
  SceneMaker(const Mesh& mesh, std::vector<std::vector<size_t>> blocks, std::vector<GltfInstance> instances)
      : mesh_(mesh), blocks_(std::move(blocks)), instances_(std::move(instances)) {}

  Result<std::optional<Mesh>> make(std::vector<std::string>& notes);

 private:
  bool changes_nothing() const;
  void begin();
  void add(const GltfInstance& instance, size_t uses);
  void add_block(const GltfInstance& instance, size_t block, const std::string& name);
  void add_point(uint32_t point, const GltfAffine& transform);
  void put(size_t array, uint64_t tuple, const GltfAffine& transform);

  const Mesh& mesh_;
  std::vector<std::vector<size_t>> blocks_;  ///< by mesh of the asset
  std::vector<GltfInstance> instances_;
  Mesh scene_;
  std::vector<uint64_t> first_cell_, first_corner_;  ///< of the blocks of mesh_
  std::vector<uint32_t> new_point_;
  bool normalized_ = false;  ///< positions of integers stand for fractions of 1
};

bool SceneMaker::changes_nothing() const {
  const bool still = std::all_of(instances_.begin(), instances_.end(),
                                 [](const GltfInstance& one) { return one.transform.is_identity(); });
  return still && instances_.size() == blocks_.size();
}

void SceneMaker::begin() {
  uint64_t cells = 0, corners = 0;
  for (const CellBlock& block : mesh_.blocks) {
    first_cell_.push_back(cells);
    first_corner_.push_back(corners);
    cells += block.size();
    corners += block.connectivity.size();
  }
  scene_.points.type = is_float(mesh_.points.type) ? mesh_.points.type : Scalar::f32;
  for (const auto& [key, value] : mesh_.metadata) {
    if (key == "gltf.normalized") normalized_ = value.find("\"position\"") != std::string::npos;
    const bool of_nodes = key == "gltf.nodes" || key == "gltf.scene" || key == "gltf.meshes";
    if (!of_nodes && key != "gltf.only") scene_.metadata.emplace_back(key, value);
  }
  for (const Array& array : mesh_.arrays) {
    scene_.arrays.push_back(empty_like(array));
    if (array.domain == Domain::mesh) scene_.arrays.back().bytes = array.bytes;
  }
}

void put_float(Buffer<std::byte>& bytes, Scalar type, double value) {
  const auto narrow = static_cast<float>(value);
  const auto* from = type == Scalar::f64 ? reinterpret_cast<const std::byte*>(&value)
                                         : reinterpret_cast<const std::byte*>(&narrow);
  bytes.insert(bytes.end(), from, from + size_of(type));
}

/// The value of one component, as glTF means it: normalised integers stand for fractions of 1, of which
/// signed ones begin at -1 (glTF 2.0, 3.11).
double component(const Array& array, uint64_t tuple, size_t k, bool normalized) {
  const double value =
      number_as_double(array.type, array.bytes.data() + tuple * array.tuple_size() + k * size_of(array.type));
  if (!normalized || is_float(array.type)) return value;
  const bool is_signed = array.type == Scalar::i8 || array.type == Scalar::i16;
  const double most = std::ldexp(1.0, static_cast<int>(8 * size_of(array.type)) - (is_signed ? 1 : 0)) - 1;
  return std::max(value / most, -1.0);
}

/// Copies a tuple. Normals and tangents turn with the mesh and keep their length; all else stays, the fourth
/// component of tangents, too.
void SceneMaker::put(size_t a, uint64_t tuple, const GltfAffine& transform) {
  const Array& from = mesh_.arrays[a];
  Array& to = scene_.arrays[a];
  const bool turns = (from.role == Role::normal || from.role == Role::tangent) && is_float(from.type) &&
                     from.components >= 3 && !transform.is_identity();
  const size_t size = from.tuple_size(), first = to.bytes.size();
  const auto* bytes = from.bytes.data() + tuple * size;
  to.bytes.insert(to.bytes.end(), bytes, bytes + size);
  if (!turns) return;
  double vector[3], turned[3] = {}, squares = 0;
  for (size_t k = 0; k < 3; ++k) vector[k] = component(from, tuple, k, false);
  const double sign = transform.determinant() < 0 ? -1 : 1;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k)
      turned[i] +=
          (from.role == Role::normal ? sign * transform.cofactor(i, k) : transform.m[i][k]) * vector[k];
    squares += turned[i] * turned[i];
  }
  if (!(squares > 0)) return;
  const double before = std::sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
  Buffer<std::byte> three;
  for (const double value : turned) put_float(three, from.type, value / std::sqrt(squares) * before);
  std::copy(three.begin(), three.end(), to.bytes.begin() + static_cast<ptrdiff_t>(first));
}

void SceneMaker::add_point(uint32_t point, const GltfAffine& transform) {
  // Bit for bit where nothing moves.
  if (transform.is_identity() && scene_.points.type == mesh_.points.type) {
    const auto* bytes = mesh_.points.bytes.data() + point * mesh_.points.tuple_size();
    scene_.points.bytes.insert(scene_.points.bytes.end(), bytes, bytes + mesh_.points.tuple_size());
  } else {
    double place[3];
    for (size_t k = 0; k < 3; ++k) place[k] = component(mesh_.points, point, k, normalized_);
    for (size_t i = 0; i < 3; ++i) {
      const auto& row = transform.m[i];
      put_float(scene_.points.bytes, scene_.points.type,
                row[0] * place[0] + row[1] * place[1] + row[2] * place[2] + row[3]);
    }
  }
  for (size_t a = 0; a < mesh_.arrays.size(); ++a) {
    if (mesh_.arrays[a].domain == Domain::point) put(a, point, transform);
  }
}

void SceneMaker::add_block(const GltfInstance& instance, size_t b, const std::string& name) {
  const CellBlock& from = mesh_.blocks[b];
  CellBlock block = from;
  block.name = name;
  // A mirrored mesh would be inside out, so its faces are turned.
  const bool mirrored = instance.transform.determinant() < 0;
  for (uint64_t cell = 0; cell < from.size(); ++cell) {
    const uint64_t first = from.offsets.empty() ? cell * nodes_of(from.type) : from.offsets[cell];
    const uint64_t size = from.cell(cell).size();
    const bool turned = mirrored && is_face(from.type_of(cell));
    for (uint64_t i = 0; i < size; ++i) {
      // The first corner stays the first.
      const uint64_t corner = first + (turned && i > 0 ? size - i : i);
      block.connectivity[first + i] = new_point_[from.connectivity[corner]];
      for (size_t a = 0; a < mesh_.arrays.size(); ++a) {
        if (mesh_.arrays[a].domain == Domain::corner) put(a, first_corner_[b] + corner, instance.transform);
      }
    }
    for (size_t a = 0; a < mesh_.arrays.size(); ++a) {
      if (mesh_.arrays[a].domain == Domain::cell) put(a, first_cell_[b] + cell, instance.transform);
    }
  }
  scene_.blocks.push_back(std::move(block));
}

void SceneMaker::add(const GltfInstance& instance, size_t uses) {
  const std::vector<size_t>& blocks = blocks_[instance.mesh];
  std::vector<uint32_t> points;
  for (const size_t b : blocks)
    points.insert(points.end(), mesh_.blocks[b].connectivity.begin(), mesh_.blocks[b].connectivity.end());
  sort_unique(points);
  for (const uint32_t point : points) {
    new_point_[point] = static_cast<uint32_t>(scene_.point_count());
    add_point(point, instance.transform);
  }
  for (size_t i = 0; i < blocks.size(); ++i) {
    std::string name = mesh_.blocks[blocks[i]].name;
    if (uses > 1 && !instance.name.empty())
      name = blocks.size() == 1 ? instance.name : instance.name + "/" + std::to_string(i);
    add_block(instance, blocks[i], name);
  }
}

Result<std::optional<Mesh>> SceneMaker::make(std::vector<std::string>& notes) {
  if (instances_.empty() || changes_nothing()) return std::nullopt;
  std::vector<size_t> uses(blocks_.size());
  uint64_t corners = 0;
  for (const GltfInstance& instance : instances_) {
    ++uses[instance.mesh];
    for (const size_t b : blocks_[instance.mesh]) corners += mesh_.blocks[b].connectivity.size();
  }
  // A few bytes of nodes can show a mesh any number of times. Beyond 2^24 corners, which any machine holds,
  // 64 times is the most; both chosen, not swept.
  constexpr uint64_t most_often = 64, always = 1 << 24;
  if (corners > always && corners / most_often > mesh_.corner_count()) {
    return failure(ErrorCode::malformed_input,
                   "the nodes of the scene show " + std::to_string(corners) +
                       " corners, more than 64 times what the mesh has; --as-stored writes each mesh once");
  }
  begin();
  new_point_.resize(mesh_.point_count());
  for (const GltfInstance& instance : instances_) add(instance, uses[instance.mesh]);
  notes.push_back(counted(instances_.size(), "node") +
                  " of the scene applied to positions, normals and tangents; --as-stored leaves them out");
  return std::optional<Mesh>(std::move(scene_));
}

}  // namespace

std::optional<GltfScene> gltf_scene_of(const Mesh& mesh) {
  const json nodes = gltf_metadata(mesh, "gltf.nodes"), roots = gltf_metadata(mesh, "gltf.scene"),
             meshes = gltf_metadata(mesh, "gltf.meshes");
  if (!nodes.is_array() || !roots.is_array() || !meshes.is_array()) return std::nullopt;
  GltfScene scene;
  size_t count = 0;
  for (const json& list : meshes) {
    scene.meshes.push_back(indices_of(list, mesh.blocks.size()));
    // Metadata of another mesh than this one, such as a part that was cut out of it.
    if (scene.meshes.back().size() != list.size()) return std::nullopt;
    count += scene.meshes.back().size();
  }
  if (count != mesh.blocks.size()) return std::nullopt;
  scene.instances = instances_of(nodes, roots, meshes.size());
  return scene;
}

Result<std::optional<Mesh>> mesh_in_scene(const Mesh& mesh, std::vector<std::string>& notes) {
  auto scene = gltf_scene_of(mesh);
  const bool plain = std::all_of(mesh.blocks.begin(), mesh.blocks.end(), [](const CellBlock& block) {
    return block.type != CellType::mixed && dimension_of(block.type) < 3;
  });
  if (!scene || !plain || mesh.points.components != 3) return std::nullopt;
  return SceneMaker(mesh, std::move(scene->meshes), std::move(scene->instances)).make(notes);
}

}  // namespace maille
