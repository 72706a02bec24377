#pragma once

#include <deque>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "io/buffered_writer.h"
#include "io/gltf/gltf_cells.h"

namespace maille {

/// One array as it will stand in the file. It points into the mesh, or to an array that the writer made.
struct GltfAttribute {
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
struct GltfRange {
  uint64_t first = 0, count = 0;
  std::vector<size_t> primitives;
  std::vector<int> accessors;  ///< one per attribute, -1 where it is left out
};

/// A value of the metadata as JSON; null where it is not there, discarded where it is no JSON. Metadata can
/// come from anybody.
nlohmann::ordered_json gltf_metadata(const Mesh& mesh, const char* key);
/// "SCALAR" ... "MAT4"; none: glTF has no tuples of that many numbers.
const char* gltf_shape_of(uint32_t components);

/// Plans what a file will hold (gltf_plan.cpp), then writes it (gltf_writer.cpp): the document with all
/// offsets is complete before the first byte of the binary part.
class GltfWriter {
 public:
  using Json = nlohmann::ordered_json;

  GltfWriter(const Mesh& mesh, Sink& sink, bool binary)
      : mesh_(mesh), sink_(sink), binary_(binary), normalized_(names_in("gltf.normalized")) {}

  Result<std::vector<std::string>> write();

 private:
  std::set<std::string> names_in(const char* key) const;
  void plan_positions();
  void plan_attributes();
  void plan_attribute(const Array& array, const Json& only);
  Scalar type_written(const Array& array);
  std::string semantic_for(const Array& array, Scalar type) const;
  std::string free_semantic(const std::string& wanted, const std::vector<bool>& blocks) const;
  bool taken(const std::string& semantic, const std::vector<bool>& blocks) const;
  const Array& with_unit_length(const Array& normals);
  void note_rest();

  void plan_ranges();
  void add_accessors();
  Json limits_of(const GltfAttribute& attribute, const GltfRange& range) const;
  void add_indices();

  void add_meshes();
  std::vector<std::vector<size_t>> meshes_by_name() const;
  bool add_nodes_from_metadata(std::vector<std::vector<size_t>>& meshes);
  Json mesh_of(const std::vector<size_t>& blocks);
  Json primitive_of(size_t index) const;
  Json asset() const;

  void put_binary(BufferedWriter& out) const;
  void put_attribute(BufferedWriter& out, const GltfAttribute& attribute) const;
  void put_indices(BufferedWriter& out) const;
  Result<> write_glb();
  Result<> write_gltf();

  const std::byte* tuple(const GltfAttribute& attribute, uint64_t point) const;

  const Mesh& mesh_;
  Sink& sink_;
  bool binary_;
  std::set<std::string> normalized_;
  GltfCells cells_;
  std::vector<GltfAttribute> attributes_;  ///< positions first
  std::deque<Array> made_;                 ///< that attributes have instead of the mesh's
  std::vector<GltfRange> ranges_;
  std::vector<size_t> range_of_;  ///< of each primitive
  std::vector<std::vector<size_t>> primitives_of_block_;
  std::vector<int> indices_accessor_;
  Json document_ = Json::object();
  uint64_t binary_size_ = 0;
  bool quantized_ = false;
  std::vector<std::string> notes_;
};

}  // namespace maille
