#pragma once

#include <maille/mesh.h>
#include <maille/source.h>
#include <cstddef>
#include <string>
#include <vector>

namespace maille::bench {

/// One array as array codecs get it: all of a mesh is a list of them.
struct Part {
  enum class Holds : uint8_t { connectivity, geometry, field };
  std::string name;
  Holds holds = Holds::field;
  Scalar type = Scalar::f32;
  size_t components = 1;  ///< also the stride of differences
  std::vector<std::byte> bytes;

  size_t tuples() const { return bytes.size() / (size_of(type) * components); }
};

/// As Exodus, and anybody who wants small files, lays it out: i32 indices by cell type, types only where they
/// are mixed.
std::vector<Part> parts_by_type(const Mesh& mesh);
/// As VTU and VTKHDF have it: i64 connectivity and offsets, u8 types, all cells in one list.
std::vector<Part> parts_as_vtk(const Mesh& mesh);

}  // namespace maille::bench
