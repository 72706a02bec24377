#pragma once

// TINYGLTF's images and external files are never used: it sees only what gltf_file.cpp leaves of the JSON.
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include "base/bytes.h"
#include "io/gltf/gltf_file.h"

namespace maille {

/// Type and shape of an accessor's elements. Columns of matrices start at multiples of four bytes in the file
/// (3.6.2.4), and are packed tightly in a mesh.
struct GltfLayout {
  Scalar type = Scalar::f32;
  uint32_t rows = 1, columns = 1;
  bool normalized = false;

  uint32_t components() const { return rows * columns; }
  uint64_t column_size() const { return rows * size_of(type); }
  uint64_t column_stride() const { return columns == 1 ? column_size() : (column_size() + 3) / 4 * 4; }
  uint64_t element_size() const { return column_stride() * (columns - 1) + column_size(); }
  uint64_t tuple_size() const { return column_size() * columns; }
};

/// Parses what describes the meshes of a file; `file.scene` is not kept. Error: malformed_input.
Result<tinygltf::Model> load_gltf_model(GltfFile& file);

/// Reads accessors from buffers; nothing in the file is believed before it is checked against them. Both must
/// outlive it. Callers take the memory for `count` elements from their budget first: a count costs a hostile
/// file nothing.
class GltfAccessors {
 public:
  GltfAccessors(const GltfFile& file, const tinygltf::Model& model) : file_(file), model_(model) {}

  Result<const tinygltf::Accessor*> get(int index, const std::string& where) const;
  Result<GltfLayout> layout(const tinygltf::Accessor& accessor, const std::string& where) const;
  /// All elements, tightly packed, into `out` (count x tuple_size bytes).
  Result<> read(const tinygltf::Accessor& accessor, const GltfLayout& layout, const std::string& where,
                std::span<std::byte> out) const;
  tl::unexpected<Error> malformed(const std::string& what) const;

 private:
  static void copy_element(const GltfLayout& layout, const std::byte* from, std::byte* to);
  /// The bytes from the first element on, checked to hold `count` elements `stride` apart.
  Result<Bytes> elements(int view_index, uint64_t offset, uint64_t count, uint64_t size, uint64_t& stride,
                         const std::string& where) const;
  Result<> read_sparse(const tinygltf::Accessor& accessor, const GltfLayout& layout, const std::string& in,
                       std::span<std::byte> out) const;

  const GltfFile& file_;
  const tinygltf::Model& model_;
};

}  // namespace maille
