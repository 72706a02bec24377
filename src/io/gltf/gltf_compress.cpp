#include "io/gltf/gltf_compress.h"

#include <maille/decode.h>

#include <algorithm>

#include "io/gltf/gltf_weights.h"
#include "io/reading.h"

namespace maille {
namespace {

/// Small meshes share a file, and so its headers and tables; one large enough to have its own is decoded only
/// when it is wanted. Chosen, not swept.
constexpr uint64_t most_shared_corners = 3 * 65536;

}  // namespace

/// A text that is equal for vertices that may be in one file if their lattice is the same: same attributes
/// and types, same order.
std::string GltfCompressor::kind_of(size_t v) const {
  const GltfVertices& vertices = vertices_[v];
  std::string kind = vertices.keep_order || options_.encoding.order == Order::keep ? "kept order " : "";
  // Where all points of a file are vertices, whether used or not, they are those of one list.
  if (!vertices.all_used()) kind += "alone " + std::to_string(v) + " ";
  return kind + layout_of(v);
}

std::string GltfCompressor::layout_of(size_t v) const {
  std::string layout;
  for (const auto& attribute : vertices_[v].attributes) {
    layout += attribute.name + " " + name_of(attribute.layout.type) + " " +
              std::to_string(attribute.layout.components()) + "\n";
  }
  return layout;
}

// Fills files of each kind in the order of the asset, so that equal assets make equal files.
std::vector<GltfBlob> GltfCompressor::plan_blobs() const {
  std::vector<GltfBlob> blobs;
  std::vector<uint64_t> corners;                                 // of each blob
  std::map<std::string, size_t> open;                            // blob by kind
  std::vector<std::vector<size_t>> triangles(vertices_.size());  // by vertices
  for (size_t t = 0; t < triangles_.size(); ++t) triangles[triangles_[t].vertices].push_back(t);
  for (size_t v = 0; v < vertices_.size(); ++v) {
    if (triangles[v].empty() || vertices_[v].used.empty()) continue;
    uint64_t size = 0;
    for (const size_t t : triangles[v]) size += triangles_[t].corners.size();
    const std::string lattice = std::to_string(lattice_of_mesh_[vertices_[v].mesh]);
    const auto [place, is_new] = open.emplace(lattice + " " + kind_of(v), blobs.size());
    if (!is_new && corners[place->second] + size > most_shared_corners) place->second = blobs.size();
    if (place->second == blobs.size()) {
      blobs.emplace_back();
      corners.push_back(0);
    }
    corners[place->second] += size;
    blobs[place->second].vertices.push_back(v);
    for (const size_t t : triangles[v]) blobs[place->second].blocks.push_back(t);
  }
  return blobs;
}

Result<Array> GltfCompressor::values_of(const GltfVertices::Attribute& attribute, uint64_t count) const {
  Array values = make_array("", Domain::point, attribute.layout.type, attribute.layout.components());
  values.resize(count);
  const std::string where = "accessor " + std::to_string(attribute.accessor);
  const tinygltf::Accessor* accessor = MAILLE_TRY(accessors_.get(attribute.accessor, where));
  MAILLE_CHECK(accessors_.read(*accessor, attribute.layout, where, values.bytes));
  return values;
}

Result<> GltfCompressor::append_points(Mesh& mesh, const GltfVertices& vertices, bool all) const {
  for (size_t a = 0; a < vertices.attributes.size(); ++a) {
    const auto& attribute = vertices.attributes[a];
    Array& array = a == 0 ? mesh.points : mesh.arrays[a - 1];
    Array values = MAILLE_TRY(values_of(attribute, vertices.count));
    const Buffer<std::byte> used = all ? std::move(values.bytes) : gltf_values(values, vertices.used);
    array.bytes.insert(array.bytes.end(), used.begin(), used.end());
  }
  return {};
}

Result<Mesh> GltfCompressor::mesh_of(const GltfBlob& blob) const {
  Mesh mesh;
  const auto& attributes = vertices_[blob.vertices[0]].attributes;
  mesh.points.type = attributes[0].layout.type;
  for (size_t a = 1; a < attributes.size(); ++a) {
    mesh.arrays.push_back(make_array(attributes[a].name, Domain::point, attributes[a].layout.type,
                                     attributes[a].layout.components(), attributes[a].role));
  }
  size_t next = 0;
  const bool all = blob.vertices.size() == 1;
  for (const size_t v : blob.vertices) {
    const auto first = static_cast<uint32_t>(mesh.point_count());
    MAILLE_CHECK(append_points(mesh, vertices_[v], all));
    for (; next < blob.blocks.size() && triangles_[blob.blocks[next]].vertices == v; ++next) {
      CellBlock block;
      block.type = CellType::triangle;
      block.connectivity = triangles_[blob.blocks[next]].corners;
      for (uint32_t& point : block.connectivity) point += first;
      mesh.blocks.push_back(std::move(block));
    }
  }
  return mesh;
}

/// Rounds weights of joints before they are coded losslessly: their sum is one of several arrays, which a
/// bound for each number would not keep.
void GltfCompressor::round_weights_of(Mesh& mesh) {
  std::vector<Array*> arrays;
  double bits = 0;
  for (Array& array : mesh.arrays) {
    const auto asked = options_.encoding.arrays.find(array.name);
    if (!is_gltf_weights(array.name) || asked == options_.encoding.arrays.end()) continue;
    named_.insert(array.name);
    if (array.type != Scalar::f32 || asked->second.kind != Tolerance::Kind::bits) continue;
    arrays.push_back(&array);
    bits = std::max(bits, asked->second.value);
  }
  round_gltf_weights(arrays, static_cast<int>(std::min<double>(bits, most_gltf_weight_bits)));
}

EncodeOptions GltfCompressor::encoding_for(const GltfBlob& blob, const Mesh& mesh) {
  EncodeOptions encoding = options_.encoding;
  encoding.mode = Mode::single;
  encoding.arrays.clear();
  encoding.provenance.clear();
  const GltfVertices& vertices = vertices_[blob.vertices[0]];
  const bool keep = std::any_of(blob.vertices.begin(), blob.vertices.end(),
                                [&](size_t v) { return vertices_[v].keep_order; });
  if (keep) encoding.order = Order::keep;
  const GltfLattice& lattice = lattices_[lattice_of_mesh_[vertices.mesh]];
  encoding.positions = is_float(mesh.points.type)
                           ? lattice.tolerance_of(gltf_positions, options_.encoding.positions)
                           : Tolerance{};
  const bool absolute = encoding.positions.kind == Tolerance::Kind::absolute ||
                        encoding.positions.kind == Tolerance::Kind::norm;
  for (const Array& array : mesh.arrays) {
    const auto asked = options_.encoding.arrays.find(array.name);
    if (asked != options_.encoding.arrays.end()) named_.insert(array.name);
    // Integers are numbers of something, and kept exactly.
    if (!is_float(array.type) || is_gltf_weights(array.name)) continue;
    // Positions of morph targets move in the same units, so they have the positions' bound unless they have
    // their own.
    const bool moves = array.name.starts_with("target") && array.name.ends_with(".position");
    if (asked != options_.encoding.arrays.end()) {
      // An array of one mesh has its lattice from end to end, by its own range.
      encoding.arrays[array.name] =
          lattice.meshes > 1 ? lattice.tolerance_of(array.name, asked->second) : asked->second;
    } else if (moves && absolute) {
      encoding.arrays[array.name] = encoding.positions;
    }
  }
  return encoding;
}

uint64_t GltfCompressor::raw_bytes(const GltfBlob& blob) const {
  uint64_t bytes = 0;
  for (const size_t v : blob.vertices) {
    for (const auto& attribute : vertices_[v].attributes)
      bytes += vertices_[v].count * attribute.layout.tuple_size();
  }
  for (const size_t t : blob.blocks) {
    const int accessor = triangles_[t].accessor;
    if (accessor < 0) continue;
    const auto layout = accessors_.layout(model_.accessors[static_cast<size_t>(accessor)], "");
    bytes += triangles_[t].corners.size() * (layout ? layout->tuple_size() : 4);
  }
  return bytes;
}

Result<> GltfCompressor::encode_blob(GltfBlob& blob) {
  Mesh mesh = MAILLE_TRY(mesh_of(blob));
  round_weights_of(mesh);
  blob.raw_bytes = raw_bytes(blob);
  const auto sink = memory_sink(blob.bytes);
  MAILLE_TRY(encode(mesh, *sink, encoding_for(blob, mesh)));
  DecodeOptions decoding;
  decoding.executor = options_.encoding.executor;
  // The decoded mesh is what readers will see: counts and bounds of accessors come from it.
  blob.mesh = MAILLE_TRY(decode(*memory_source(Bytes(blob.bytes)), decoding));
  return {};
}

/// Marks the accessors that something else needs as they are: primitives that stay, animations, skins,
/// instances.
void GltfCompressor::mark_kept_accessors() {
  const auto keep = [&](const GltfJson& object, const char* key) {
    if (const auto number = gltf_number(object, key)) owners_[static_cast<int>(*number)] = "kept";
  };
  const auto keep_all = [&](const GltfJson& object) {
    if (!object.is_object()) return;
    for (const auto& [name, value] : object.items()) keep(object, name.c_str());
  };
  std::set<std::pair<size_t, size_t>> compressed;
  std::set<size_t> triangles;
  for (const GltfBlob& blob : blobs_) triangles.insert(blob.blocks.begin(), blob.blocks.end());
  for (const GltfCandidate& one : candidates_) {
    if (triangles.count(one.triangles) != 0) compressed.insert({one.mesh, one.primitive});
  }
  const GltfJson& meshes = gltf_list(document_.json, "meshes");
  for (size_t m = 0; m < meshes.size(); ++m) {
    const GltfJson& primitives = gltf_list(meshes[m], "primitives");
    for (size_t p = 0; p < primitives.size(); ++p) {
      if (compressed.count({m, p}) != 0) continue;
      keep(primitives[p], "indices");
      if (const GltfJson* attributes = gltf_member(primitives[p], "attributes")) keep_all(*attributes);
      for (const GltfJson& target : gltf_list(primitives[p], "targets")) keep_all(target);
    }
  }
  for (const GltfJson& animation : gltf_list(document_.json, "animations")) {
    for (const GltfJson& sampler : gltf_list(animation, "samplers")) keep_all(sampler);
  }
  for (const GltfJson& skin : gltf_list(document_.json, "skins")) keep(skin, "inverseBindMatrices");
  for (const GltfJson& node : gltf_list(document_.json, "nodes")) {
    const GltfJson* extensions = gltf_member(node, "extensions");
    if (extensions == nullptr || !extensions->is_object()) continue;
    for (const GltfJson& extension : *extensions) {
      if (const GltfJson* attributes = gltf_member(extension, "attributes")) keep_all(*attributes);
    }
  }
}

/// The accessor for this owner, or a copy of it where it is another one's already: two owners may need other
/// counts.
int GltfCompressor::take_accessor(int accessor, const std::string& owner) {
  const auto [place, is_new] = owners_.emplace(accessor, owner);
  if (is_new || place->second == owner) return accessor;
  const auto [copy, first] = copies_.emplace(std::pair(accessor, owner), 0);
  if (first) {
    GltfJson& list = document_.json["accessors"];
    copy->second = static_cast<int>(list.size());
    list.push_back(GltfJson(list[static_cast<size_t>(accessor)]));
  }
  return copy->second;
}

/// Takes the bytes away from an accessor and gives it so many elements. Its views are free if nothing else
/// has them.
GltfJson& GltfCompressor::empty_accessor(int number, uint64_t count) {
  GltfJson& accessor = document_.json["accessors"][static_cast<size_t>(number)];
  const auto note_view = [&](const GltfJson& object) {
    const auto view = gltf_number(object, "bufferView");
    if (view && *view < document_.view_count()) views_before_.push_back(static_cast<size_t>(*view));
  };
  note_view(accessor);
  if (const GltfJson* sparse = gltf_member(accessor, "sparse")) {
    for (const char* key : {"indices", "values"}) {
      if (const GltfJson* part = gltf_member(*sparse, key)) note_view(*part);
    }
  }
  for (const char* key : {"bufferView", "byteOffset", "sparse"}) accessor.erase(key);
  accessor["count"] = count;
  return accessor;
}

void GltfCompressor::put_vertices(const GltfBlob& blob, size_t v) {
  std::vector<uint64_t> blocks;
  for (size_t b = 0; b < blob.blocks.size(); ++b) {
    if (triangles_[blob.blocks[b]].vertices == v) blocks.push_back(b);
  }
  const std::vector<uint32_t> points = gltf_vertices(blob.mesh, blocks, blob.vertices.size() == 1);
  const auto& attributes = vertices_[v].attributes;
  for (size_t a = 0; a < attributes.size(); ++a) {
    const std::string owner = std::to_string(v) + " " + std::to_string(a);
    accessors_of_vertices_[v].push_back(take_accessor(attributes[a].accessor, owner));
    GltfJson& accessor = empty_accessor(accessors_of_vertices_[v].back(), points.size());
    // The bounds of positions are wanted by the standard; no bound is copied, as values and vertices change.
    if (attributes[a].semantic == "POSITION" || accessor.contains("min") || accessor.contains("max"))
      set_gltf_limits(accessor, a == 0 ? blob.mesh.points : blob.mesh.arrays[a - 1], points);
  }
  for (const uint64_t b : blocks) put_triangles(blob.mesh.blocks[b], blob.blocks[b], points);
}

void GltfCompressor::put_triangles(const CellBlock& block, size_t t, const std::vector<uint32_t>& points) {
  int& number = accessor_of_triangles_[t];
  if (triangles_[t].accessor >= 0) {
    // Its type is wide enough: there are no more vertices than before.
    number = take_accessor(triangles_[t].accessor, "triangles " + std::to_string(t));
  } else {
    number = static_cast<int>(document_.json["accessors"].size());
    document_.json["accessors"].push_back(
        {{"componentType", points.size() <= 65535 ? 5123 : 5125}, {"count", 0}, {"type", "SCALAR"}});
  }
  GltfJson& accessor = empty_accessor(number, block.connectivity.size());
  if (!accessor.contains("min") && !accessor.contains("max")) return;
  const std::vector<uint32_t> indices = gltf_indices(block, points);
  const auto [low, high] = std::minmax_element(indices.begin(), indices.end());
  accessor["min"] = {*low};
  accessor["max"] = {*high};
}

void GltfCompressor::link_primitives(const GltfBlob& blob, size_t view) {
  for (const GltfCandidate& candidate : candidates_) {
    const auto place = std::find(blob.blocks.begin(), blob.blocks.end(), candidate.triangles);
    if (place == blob.blocks.end()) continue;
    GltfJson& primitive = document_.json["meshes"][candidate.mesh]["primitives"][candidate.primitive];
    const size_t v = triangles_[candidate.triangles].vertices;
    GltfLink link;
    link.view = view;
    link.block = static_cast<uint64_t>(place - blob.blocks.begin());
    link.targets.resize(gltf_list(primitive, "targets").size());
    for (size_t a = 0; a < vertices_[v].attributes.size(); ++a) {
      const auto& attribute = vertices_[v].attributes[a];
      const auto target = static_cast<size_t>(attribute.target);
      (attribute.target < 0 ? link.attributes : link.targets[target])
          .emplace_back(attribute.semantic, attribute.name);
      GltfJson& names = attribute.target < 0 ? primitive["attributes"] : primitive["targets"][target];
      names[attribute.semantic] = accessors_of_vertices_[v][a];
    }
    primitive["indices"] = accessor_of_triangles_[candidate.triangles];
    primitive["extensions"][gltf_extension] = to_json(link);
  }
}

GltfReport GltfCompressor::report() const {
  GltfReport report;
  std::set<size_t> triangles;
  for (const GltfBlob& blob : blobs_) {
    triangles.insert(blob.blocks.begin(), blob.blocks.end());
    report.points += blob.mesh.point_count();
    report.triangles += blob.mesh.cell_count();
    report.geometry_bytes += blob.raw_bytes;
    report.coded_bytes += blob.bytes.size();
  }
  report.files = blobs_.size();
  for (const tinygltf::Mesh& mesh : model_.meshes) report.primitives += mesh.primitives.size();
  for (const GltfCandidate& one : candidates_) report.compressed += triangles.count(one.triangles);
  for (const auto& [reason, count] : left_)
    report.notes.push_back(counted(count, "primitive") + " left uncompressed: " + reason);
  const uint64_t larger = candidates_.size() - report.compressed;
  if (larger != 0)
    report.notes.push_back(counted(larger, "primitive") + " left uncompressed: it would be no smaller");
  for (const auto& [name, tolerance] : options_.encoding.arrays) {
    if (named_.count(name) == 0) report.notes.push_back("no primitive has an array '" + name + "'");
    if (named_.count(name) != 0 && is_gltf_weights(name) && tolerance.kind != Tolerance::Kind::bits)
      report.notes.push_back("'" + name +
                             "' is kept exactly: only --bits rounds weights so that they add up to 1");
  }
  report.input_bytes = document_.file.total_bytes;
  return report;
}

Result<GltfReport> GltfCompressor::run() {
  MAILLE_CHECK(find_candidates());
  MAILLE_CHECK(choose_lattices());
  std::vector<GltfBlob> blobs = plan_blobs();
  for (size_t b = 0; b < blobs.size(); ++b) {
    MAILLE_CHECK(report_progress(options_.encoding.progress, "compressing",
                                 static_cast<double>(b) / static_cast<double>(blobs.size())));
    MAILLE_CHECK(encode_blob(blobs[b]));
    // Files that are no smaller are dropped, and their primitives stay as they are.
    if (blobs[b].bytes.size() < blobs[b].raw_bytes) blobs_.push_back(std::move(blobs[b]));
  }
  mark_kept_accessors();
  accessors_of_vertices_.resize(vertices_.size());
  accessor_of_triangles_.resize(triangles_.size());
  for (const GltfBlob& blob : blobs_) {
    for (const size_t v : blob.vertices) put_vertices(blob, v);
  }
  document_.free_views(views_before_);
  for (const GltfBlob& blob : blobs_) link_primitives(blob, document_.add_view(blob.bytes));
  if (!blobs_.empty()) document_.use_extension(gltf_extension);
  return report();
}

/// The triangles that each block of a file has, in the order of the blocks; nothing where a primitive is no
/// such triangles, or no primitive has a block.
std::optional<GltfBlob> GltfCompressor::blob_of(const GltfPart& part) const {
  std::map<uint64_t, size_t> by_block;
  for (const GltfPart::Place& place : part.places) {
    const auto found = std::find_if(candidates_.begin(), candidates_.end(), [&](const GltfCandidate& one) {
      return one.mesh == place.mesh && one.primitive == place.primitive;
    });
    if (found == candidates_.end()) return std::nullopt;
    if (by_block.emplace(place.block, found->triangles).first->second != found->triangles)
      return std::nullopt;
  }
  GltfBlob blob;
  for (const auto& [block, triangles] : by_block) {
    if (block != blob.blocks.size()) return std::nullopt;
    blob.blocks.push_back(triangles);
    const size_t vertices = triangles_[triangles].vertices;
    if (blob.vertices.empty() || blob.vertices.back() != vertices) blob.vertices.push_back(vertices);
    if (layout_of(vertices) != layout_of(blob.vertices[0])) return std::nullopt;
  }
  // mesh_of() joins vertices only where triangles use all of them, as plan_blobs() has it.
  const bool alone = blob.vertices.size() == 1;
  const bool all_used = std::all_of(blob.vertices.begin(), blob.vertices.end(),
                                    [&](size_t v) { return vertices_[v].all_used(); });
  return alone || all_used ? std::optional(std::move(blob)) : std::nullopt;
}

Result<std::vector<Mesh>> GltfCompressor::originals(std::span<const GltfPart> parts) {
  MAILLE_CHECK(find_candidates());
  std::vector<Mesh> meshes;
  for (const GltfPart& part : parts) {
    const std::optional<GltfBlob> blob = blob_of(part);
    if (!blob) {
      return failure(ErrorCode::differs, document_.file.name + ": it has no such triangles as buffer view " +
                                             std::to_string(part.buffer_view) + " holds");
    }
    meshes.push_back(MAILLE_TRY(mesh_of(*blob)));
  }
  return meshes;
}

Result<std::vector<Array>> GltfCompressor::arrays() {
  MAILLE_CHECK(find_candidates());
  std::vector<Array> arrays;
  std::set<std::string> names = {gltf_positions};
  for (const GltfVertices& vertices : vertices_) {
    for (const auto& attribute : vertices.attributes) {
      if (!names.insert(attribute.name).second) continue;
      arrays.push_back(make_array(attribute.name, Domain::point, attribute.layout.type,
                                  attribute.layout.components(), attribute.role));
    }
  }
  return arrays;
}

namespace {

Result<GltfDocument> open_uncompressed(const Source& source) {
  GltfDocument document = MAILLE_TRY(GltfDocument::open(source));
  const GltfJson& used = gltf_list(document.json, "extensionsUsed");
  for (const char* name :
       {gltf_extension, "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"}) {
    if (!gltf_lists(used, name)) continue;
    return failure(
        ErrorCode::unsupported,
        source.name() + ": it is compressed already, by " + name + "; decompress it first, " +
            (name == gltf_extension ? "with `maille decompress`" : "e.g. with \"gltf-transform copy\""));
  }
  return document;
}

}  // namespace

Result<std::vector<Array>> gltf_arrays(const Source& source) {
  GltfDocument document = MAILLE_TRY(open_uncompressed(source));
  const tinygltf::Model model = MAILLE_TRY(load_gltf_model(document.file));
  const GltfCompressOptions options;
  return GltfCompressor(document, model, options).arrays();
}

Result<std::vector<Mesh>> gltf_originals(const Source& original, std::span<const GltfPart> parts,
                                         const Limits& limits) {
  GltfDocument document = MAILLE_TRY(open_uncompressed(original));
  const tinygltf::Model model = MAILLE_TRY(load_gltf_model(document.file));
  GltfCompressOptions options;
  options.limits = limits;
  return GltfCompressor(document, model, options).originals(parts);
}

Result<GltfReport> compress_gltf(const Source& source, Sink& sink, const GltfCompressOptions& options) {
  GltfDocument document = MAILLE_TRY(open_uncompressed(source));
  const tinygltf::Model model = MAILLE_TRY(load_gltf_model(document.file));
  GltfReport report = MAILLE_TRY(GltfCompressor(document, model, options).run());
  report.file_bytes = MAILLE_TRY(document.write(sink, options.text));
  return report;
}

}  // namespace maille
