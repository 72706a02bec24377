// Takes geometry out of the .maille files of a glTF asset, back into accessors.
#include <maille/decode.h>
#include <maille/gltf.h>

#include <algorithm>
#include <map>
#include <memory>

#include "base/bytes.h"
#include "base/sort_unique.h"
#include "io/budget.h"
#include "io/gltf/gltf_blob.h"
#include "io/gltf/gltf_document.h"
#include "io/gltf/gltf_writer.h"
#include "io/reading.h"

namespace maille {
namespace {

// glTF 2.0, 5.11.5: ARRAY_BUFFER and ELEMENT_ARRAY_BUFFER.
constexpr int vertex_target = 34962, index_target = 34963;

/// A primitive that has the extension. `primitive` points into the document, whose meshes do not move.
struct Linked {
  GltfJson* primitive = nullptr;
  GltfLink link;
  uint64_t position = 0;  ///< its accessor: primitives that share it share their vertices
  GltfPart::Place place;
  std::string where, name;
};

/// Values of accessors come from decoded meshes, in the numbering of gltf_vertices(). Whatever the asset says
/// beside is checked against the meshes: counts, types, and that no accessor is given twice with different
/// values.
class GltfDecompressor {
 public:
  GltfDecompressor(GltfDocument& document, const GltfDecompressOptions& options)
      : document_(document), options_(options) {}

  Result<> find();
  const std::vector<Linked>& linked() const { return linked_; }
  Result<GltfReport> run();

 private:
  /// One .maille file after the other, so that only one is decoded in memory.
  Result<> decompress(uint64_t view, Bytes bytes, const std::vector<Linked*>& primitives);
  void free_views();
  Result<> give_vertices(const Mesh& mesh, const std::vector<Linked*>& primitives, bool alone);
  Result<> give_primitive(const Mesh& mesh, const std::vector<uint32_t>& vertices, Linked& linked);
  Result<> give_names(const Mesh& mesh, const std::vector<uint32_t>& vertices, const GltfNames& names,
                      const GltfJson* accessors, const std::string& where);
  Result<> give_indices(const CellBlock& block, const std::vector<uint32_t>& vertices, const Linked& linked);
  Result<GltfJson*> accessor_at(uint64_t number, const std::string& where, uint64_t count);
  Result<> take(uint64_t bytes);
  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input, document_.file.name + ": " + what);
  }

  GltfDocument& document_;
  const GltfDecompressOptions& options_;
  std::vector<Linked> linked_;
  std::map<uint64_t, std::string> given_;  ///< accessors, with what they hold
  uint64_t taken_ = 0;
  GltfReport report_;
};

Result<> GltfDecompressor::find() {
  if (!document_.json.contains("meshes") || !document_.json["meshes"].is_array()) return {};
  GltfJson& meshes = document_.json["meshes"];
  for (size_t m = 0; m < meshes.size(); ++m) {
    if (gltf_member(meshes[m], "primitives") == nullptr || !meshes[m]["primitives"].is_array()) continue;
    const GltfJson* title = gltf_member(meshes[m], "name");
    const std::string name = title && title->is_string() ? title->get<std::string>() : std::to_string(m);
    for (size_t p = 0; p < meshes[m]["primitives"].size(); ++p) {
      ++report_.primitives;
      GltfJson& primitive = meshes[m]["primitives"][p];
      const GltfJson* extensions = gltf_member(primitive, "extensions");
      const GltfJson* object = extensions ? gltf_member(*extensions, gltf_extension) : nullptr;
      if (object == nullptr) continue;
      Linked linked;
      linked.primitive = &primitive;
      linked.where = "mesh " + std::to_string(m) + ", primitive " + std::to_string(p);
      linked.name = name + "/" + std::to_string(p);
      linked.link = MAILLE_TRY(
          link_from_json(*object, document_.file.name + ": " + linked.where + ", " + gltf_extension));
      if (linked.link.view >= document_.view_count())
        return malformed(linked.where + " names a buffer view that does not exist");
      const GltfJson* attributes = gltf_member(primitive, "attributes");
      const auto position = attributes ? gltf_number(*attributes, "POSITION") : std::nullopt;
      if (!position) return malformed(linked.where + " has no positions");
      linked.position = *position;
      linked.place = {m, p, linked.link.block};
      linked_.push_back(std::move(linked));
    }
  }
  return {};
}

Result<> GltfDecompressor::take(uint64_t bytes) {
  if (bytes <= options_.limits.mesh_bytes - taken_) {
    taken_ += bytes;
    return {};
  }
  return failure(ErrorCode::memory_bound, document_.file.name + ": the geometry needs more than the " +
                                              std::to_string(options_.limits.mesh_bytes) +
                                              " bytes allowed; raise the memory limit if you trust the file");
}

/// An accessor that is to get values: one that is there, has none, and is of as many elements as were
/// decoded.
Result<GltfJson*> GltfDecompressor::accessor_at(uint64_t number, const std::string& where, uint64_t count) {
  if (number >= gltf_list(document_.json, "accessors").size())
    return malformed(where + " uses accessor " + std::to_string(number) + ", which does not exist");
  GltfJson& accessor = document_.json["accessors"][number];
  if (!accessor.is_object()) return malformed("accessor " + std::to_string(number) + " is no object");
  if (accessor.contains("bufferView") || accessor.contains("sparse"))
    return malformed(where + ": accessor " + std::to_string(number) + " has values besides those compressed");
  if (gltf_number(accessor, "count") != count) {
    return malformed(where + ": accessor " + std::to_string(number) + " is not of the " +
                     std::to_string(count) + " elements that were decoded");
  }
  return &accessor;
}

Result<> GltfDecompressor::give_names(const Mesh& mesh, const std::vector<uint32_t>& vertices,
                                      const GltfNames& names, const GltfJson* accessors,
                                      const std::string& where) {
  for (const auto& [semantic, name] : names) {
    const std::string in = where + ", " + semantic;
    const auto number = accessors ? gltf_number(*accessors, semantic.c_str()) : std::nullopt;
    if (!number) return malformed(in + " is in the extension, but not in the primitive");
    const Array* array = gltf_array(mesh, name);
    if (array == nullptr) return malformed(in + ": the .maille file has no array '" + name + "' of points");
    if (const auto known = given_.find(*number); known != given_.end()) {
      if (known->second == name) continue;
      return malformed(in + ": accessor " + std::to_string(*number) + " is given twice");
    }
    GltfJson& accessor = *MAILLE_TRY(accessor_at(*number, in, vertices.size()));
    const char* shape = gltf_shape_of(array->components);
    const GltfJson* type = gltf_member(accessor, "type");
    if (gltf_number(accessor, "componentType") != static_cast<uint64_t>(gltf_component_type(array->type)) ||
        shape == nullptr || type == nullptr || *type != shape)
      return malformed(in + ": the .maille file has values of another type than the accessor");
    // 3 for padding, at most.
    MAILLE_CHECK(take(vertices.size() * (array->tuple_size() + 3)));
    std::vector<std::byte> values = gltf_values(*array, vertices);
    // Elements of vertices start at multiples of four bytes (glTF 2.0, 3.6.2.4).
    const size_t size = array->tuple_size(), stride = (size + 3) / 4 * 4;
    GltfJson view = {{"target", vertex_target}};
    if (stride != size) {
      std::vector<std::byte> wide(vertices.size() * stride);
      for (size_t i = 0; i < vertices.size(); ++i)
        std::copy_n(values.begin() + static_cast<ptrdiff_t>(i * size), size,
                    wide.begin() + static_cast<ptrdiff_t>(i * stride));
      values = std::move(wide);
      view["byteStride"] = stride;
    }
    accessor["bufferView"] = document_.add_view(std::move(values), view);
    given_[*number] = name;
  }
  return {};
}

Result<> GltfDecompressor::give_indices(const CellBlock& block, const std::vector<uint32_t>& vertices,
                                        const Linked& linked) {
  const std::string in = linked.where + ", indices";
  const auto number = gltf_number(*linked.primitive, "indices");
  if (!number) return malformed(linked.where + " has no accessor for its indices");
  const std::string what = "block " + std::to_string(linked.link.block);
  if (const auto known = given_.find(*number); known != given_.end()) {
    if (known->second == what) return {};
    return malformed(in + ": accessor " + std::to_string(*number) + " is given twice");
  }
  GltfJson& accessor = *MAILLE_TRY(accessor_at(*number, in, block.connectivity.size()));
  const uint64_t type = gltf_number(accessor, "componentType").value_or(0);
  const GltfJson* shape = gltf_member(accessor, "type");
  const size_t size = type == 5121 ? 1 : type == 5123 ? 2 : type == 5125 ? 4 : 0;
  if (size == 0 || shape == nullptr || *shape != "SCALAR")
    return malformed(in + ": the accessor is not of unsigned integers");
  if (size < 4 && vertices.size() > (uint64_t{1} << (8 * size)))
    return malformed(in + ": there are too many vertices for the accessor's type");
  MAILLE_CHECK(take(block.connectivity.size() * 4));
  const std::vector<uint32_t> indices = gltf_indices(block, vertices);
  std::vector<std::byte> values(indices.size() * size);
  for (size_t i = 0; i < indices.size(); ++i) std::memcpy(values.data() + i * size, &indices[i], size);
  accessor["bufferView"] = document_.add_view(std::move(values), {{"target", index_target}});
  given_[*number] = what;
  return {};
}

Result<> GltfDecompressor::give_primitive(const Mesh& mesh, const std::vector<uint32_t>& vertices,
                                          Linked& linked) {
  GltfJson& primitive = *linked.primitive;
  MAILLE_CHECK(
      give_names(mesh, vertices, linked.link.attributes, gltf_member(primitive, "attributes"), linked.where));
  const GltfJson& targets = gltf_list(primitive, "targets");
  for (size_t t = 0; t < linked.link.targets.size(); ++t) {
    MAILLE_CHECK(give_names(mesh, vertices, linked.link.targets[t],
                            t < targets.size() ? &targets[t] : nullptr,
                            linked.where + ", target " + std::to_string(t)));
  }
  return give_indices(mesh.blocks[linked.link.block], vertices, linked);
}

Result<> GltfDecompressor::give_vertices(const Mesh& mesh, const std::vector<Linked*>& primitives,
                                         bool alone) {
  std::vector<uint64_t> blocks;
  for (const Linked* linked : primitives) {
    const uint64_t block = linked->link.block;
    if (block >= mesh.blocks.size() || mesh.blocks[block].type != CellType::triangle)
      return malformed(linked->where + ": the .maille file has no block " + std::to_string(block) +
                       " of triangles");
    blocks.push_back(block);
  }
  sort_unique(blocks);
  // Many primitives over one file are cheap to write down, but not to read: each takes from the limit.
  for (const uint64_t block : blocks) MAILLE_CHECK(take(mesh.blocks[block].connectivity.size() * 4));
  if (alone) MAILLE_CHECK(take(mesh.point_count() * 4));
  const std::vector<uint32_t> vertices = gltf_vertices(mesh, blocks, alone);
  report_.points += vertices.size();
  for (Linked* linked : primitives) MAILLE_CHECK(give_primitive(mesh, vertices, *linked));
  return {};
}

Result<> GltfDecompressor::decompress(uint64_t view, Bytes bytes, const std::vector<Linked*>& primitives) {
  const std::string name = document_.file.name + ": buffer view " + std::to_string(view);
  DecodeOptions decoding;
  // The limit is for the whole asset: what earlier files took is gone.
  decoding.limits.mesh_bytes = options_.limits.mesh_bytes - taken_;
  decoding.executor = options_.executor;
  const Mesh mesh = MAILLE_TRY(decode(*memory_source(bytes, name), decoding));
  report_.coded_bytes += bytes.size();
  report_.triangles += mesh.cell_count();
  ++report_.files;
  std::map<uint64_t, std::vector<Linked*>> by_vertices;
  for (Linked* linked : primitives) by_vertices[linked->position].push_back(linked);
  for (const auto& [position, sharing] : by_vertices)
    MAILLE_CHECK(give_vertices(mesh, sharing, by_vertices.size() == 1));
  return {};
}

/// Frees the views of the .maille files, and those that compressing left over (GltfDocument::place_views()).
void GltfDecompressor::free_views() {
  std::vector<size_t> views;
  for (Linked& linked : linked_) {
    views.push_back(linked.link.view);
    GltfJson& primitive = *linked.primitive;
    primitive["extensions"].erase(gltf_extension);
    if (primitive["extensions"].empty()) primitive.erase("extensions");
  }
  const GltfJson left_over = {{"buffer", 0}, {"byteLength", 4}};
  const GltfJson& list = gltf_list(document_.json, "bufferViews");
  for (size_t i = 0; i < list.size(); ++i) {
    if (list[i] == left_over) views.push_back(i);
  }
  document_.free_views(views);
}

Result<GltfReport> GltfDecompressor::run() {
  MAILLE_CHECK(find());
  // By number of the view, so that new views come in the same order everywhere.
  std::map<uint64_t, std::vector<Linked*>> by_view;
  std::map<uint64_t, Bytes> contents;  // as views are taken again
  for (Linked& linked : linked_) {
    by_view[linked.link.view].push_back(&linked);
    contents[linked.link.view] = document_.content(linked.link.view);
  }
  free_views();
  for (const auto& [view, primitives] : by_view) MAILLE_CHECK(decompress(view, contents[view], primitives));
  document_.drop_extension(gltf_extension);
  report_.compressed = linked_.size();
  report_.geometry_bytes = taken_;
  report_.input_bytes = document_.file.total_bytes;
  return report_;
}

}  // namespace

Result<GltfReport> decompress_gltf(const Source& source, Sink& sink, const GltfDecompressOptions& options) {
  GltfDocument document = MAILLE_TRY(GltfDocument::open(source));
  if (!document.file.compressed) {
    return failure(ErrorCode::usage, source.name() + ": it does not use the extension " + gltf_extension +
                                         ", so there is nothing to decompress");
  }
  GltfReport report = MAILLE_TRY(GltfDecompressor(document, options).run());
  report.file_bytes = MAILLE_TRY(document.write(sink, options.text));
  return report;
}

Result<std::vector<GltfPart>> gltf_parts(const Source& source) {
  std::vector<GltfPart> parts;
  std::byte first[4] = {};
  if (source.size() < sizeof first || !source.read_at(0, first)) return parts;
  // JSON may begin with a blank or a line end; whatever else it is, parsing decides.
  const bool may_be = std::memcmp(first, "glTF", 4) == 0 || first[0] == std::byte{'{'} ||
                      first[0] == std::byte{' '} || first[0] == std::byte{'\n'};
  if (!may_be) return parts;
  auto document = GltfDocument::open(source);
  if (!document) {
    if (std::memcmp(first, "glTF", 4) != 0) return parts;  // JSON of some other kind
    return tl::unexpected(document.error());
  }
  if (!document->file.compressed) return parts;
  GltfDecompressor finder(*document, {});
  MAILLE_CHECK(finder.find());
  std::map<uint64_t, GltfPart> by_view;
  for (const Linked& linked : finder.linked()) {
    GltfPart& part = by_view[linked.link.view];
    part.buffer_view = linked.link.view;
    part.primitives.push_back(linked.name);
    part.places.push_back(linked.place);
  }
  for (auto& [view, part] : by_view) {
    const Bytes bytes = document->content(view);
    part.bytes.assign(bytes.begin(), bytes.end());
    parts.push_back(std::move(part));
  }
  return parts;
}

}  // namespace maille
