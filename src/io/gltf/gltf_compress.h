#pragma once

#include <maille/gltf.h>

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "io/budget.h"
#include "io/gltf/gltf_accessors.h"
#include "io/gltf/gltf_blob.h"
#include "io/gltf/gltf_document.h"

namespace maille {

/// Vertices as primitives with the same accessors have them; the unit of what is coded together.
struct GltfVertices {
  struct Attribute {
    std::string semantic, name;  ///< of glTF, of maille
    int target = -1;             ///< of which it is, or of none
    int accessor = 0;
    Role role = Role::none;
    GltfLayout layout;
  };
  std::vector<Attribute> attributes;  ///< POSITION first
  uint64_t count = 0;
  size_t mesh = 0;  ///< of its first primitive
  bool keep_order = false;
  std::vector<uint32_t> used;  ///< by some triangle, in rising order

  bool all_used() const { return used.size() == count; }
};

/// Triangles over vertices, as primitives with the same indices share them.
struct GltfTriangles {
  size_t vertices = 0;
  int accessor = -1;
  std::vector<uint32_t> corners;
};

/// A primitive that the extension can hold.
struct GltfCandidate {
  size_t mesh = 0, primitive = 0, triangles = 0;
};

/// What meshes of the asset that are rounded alike have in common: positions and arrays whose tolerances go
/// by a range, by name.
struct GltfLattice {
  struct Values {
    double error = 0;      ///< the largest; 0: nothing can be rounded
    uint64_t numbers = 0;  ///< of all meshes
  };
  std::map<std::string, Values> arrays;
  size_t meshes = 1;
  double bits = 0;  ///< that its being finer than asked for costs

  /// The tolerance that was asked for, or this lattice's where it goes by a range.
  Tolerance tolerance_of(const std::string& array, const Tolerance& asked) const;
};

/// A .maille file and what is in it: vertices and, as its blocks, triangles by their numbers in the lists of
/// the compressor.
struct GltfBlob {
  std::vector<size_t> vertices, blocks;
  Mesh mesh;  ///< decoded
  std::vector<std::byte> bytes;
  uint64_t raw_bytes = 0;
};

/// Finds what can be compressed (gltf_candidates.cpp), chooses lattices (gltf_lattices.cpp), codes and puts
/// it into the document (gltf_compress.cpp). Whatever else is in the asset keeps its bytes, its order and its
/// numbers.
class GltfCompressor {
 public:
  GltfCompressor(GltfDocument& document, const tinygltf::Model& model, const GltfCompressOptions& options)
      : document_(document),
        model_(model),
        accessors_(document.file, model),
        options_(options),
        budget_(document.file.name, document.file.total_bytes, options.limits) {}

  // run() compresses; arrays() lists what could be; originals() gives the meshes behind the files of a
  // compressed asset, for comparison. One of them is called, once.
  Result<GltfReport> run();
  Result<std::vector<Array>> arrays();
  Result<std::vector<Mesh>> originals(std::span<const GltfPart> parts);

 private:
  Result<> find_candidates();
  Result<> add_primitive(size_t mesh, size_t primitive);
  std::string reason_against(const tinygltf::Primitive& primitive, const GltfJson& json) const;
  std::string reason_against(const tinygltf::Accessor& accessor) const;
  Result<size_t> vertices_of(const tinygltf::Primitive& primitive, size_t mesh);
  Result<std::vector<GltfVertices::Attribute>> attributes_of(const tinygltf::Primitive& primitive) const;
  Result<size_t> triangles_of(const tinygltf::Primitive& primitive, size_t vertices,
                              const std::string& where);
  bool is_blended(int material) const;
  void find_used_vertices();
  void leave(const std::string& reason) { ++left_[reason]; }

  Result<> choose_lattices();
  Result<GltfLattice> lattice_of(const std::vector<size_t>& vertices) const;
  const Tolerance* tolerance_by_range(const GltfVertices::Attribute& attribute) const;

  std::vector<GltfBlob> plan_blobs() const;
  std::string kind_of(size_t vertices) const;
  std::string layout_of(size_t vertices) const;
  Result<> encode_blob(GltfBlob& blob);
  std::optional<GltfBlob> blob_of(const GltfPart& part) const;
  Result<Mesh> mesh_of(const GltfBlob& blob) const;
  Result<Array> values_of(const GltfVertices::Attribute& attribute, uint64_t count) const;
  Result<> append_points(Mesh& mesh, const GltfVertices& vertices, bool all) const;
  EncodeOptions encoding_for(const GltfBlob& blob, const Mesh& mesh);
  void round_weights_of(Mesh& mesh);
  uint64_t raw_bytes(const GltfBlob& blob) const;

  void mark_kept_accessors();
  int take_accessor(int accessor, const std::string& owner);
  GltfJson& empty_accessor(int number, uint64_t count);
  void put_vertices(const GltfBlob& blob, size_t vertices);
  void put_triangles(const CellBlock& block, size_t triangles, const std::vector<uint32_t>& points);
  void link_primitives(const GltfBlob& blob, size_t view);
  GltfReport report() const;

  GltfDocument& document_;
  const tinygltf::Model& model_;
  GltfAccessors accessors_;
  const GltfCompressOptions& options_;
  Budget budget_;

  std::vector<GltfCandidate> candidates_;
  std::vector<GltfVertices> vertices_;
  std::vector<GltfTriangles> triangles_;
  std::map<std::string, size_t> vertices_by_key_, triangles_by_key_;
  std::map<std::string, uint64_t> left_;  ///< primitives, by the reason
  std::vector<GltfLattice> lattices_;
  std::vector<size_t> lattice_of_mesh_;                  ///< numbers in `lattices_`
  std::vector<GltfBlob> blobs_;                          ///< those that make something smaller
  std::vector<std::vector<int>> accessors_of_vertices_;  ///< in the document written, by attribute
  std::vector<int> accessor_of_triangles_;
  std::map<int, std::string> owners_;                  ///< of accessors
  std::map<std::pair<int, std::string>, int> copies_;  ///< of accessors, for other owners
  std::vector<size_t> views_before_;
  std::set<std::string> named_;  ///< arrays that some tolerance met
};

}  // namespace maille
