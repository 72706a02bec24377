#pragma once

#include <maille/buffer.h>
#include <maille/error.h>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

// Functions of this library may run in several threads at once, each with objects of its own; an object is
// for one thread at a time unless it says otherwise. What is const and is not changed meanwhile, such as a
// Mesh or a Source, several threads may read.
namespace maille {

/// Type of one number in an array.
enum class Scalar : uint8_t { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };
inline constexpr unsigned scalar_count = 10;

/// Bytes of one number: 1, 2, 4 or 8. As for all enumerations here, the value must be one that has a name.
size_t size_of(Scalar type);
/// "i8" ... "f64".
const char* name_of(Scalar type);
inline bool is_float(Scalar type) {
  return type >= Scalar::f32;
}

/// The Scalar of a C++ type: of integers by size and sign, float, double.
template <class T>
constexpr Scalar scalar_of() {
  static_assert(std::is_arithmetic_v<T> && sizeof(T) <= 8);
  if constexpr (std::is_floating_point_v<T>) {
    return sizeof(T) == 4 ? Scalar::f32 : Scalar::f64;
  } else {
    constexpr Scalar of_sign[] = {Scalar::i8, Scalar::i16, Scalar::i32, Scalar::i64};
    constexpr auto size = sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 1 : sizeof(T) == 4 ? 2 : 3;
    return static_cast<Scalar>(static_cast<unsigned>(of_sign[size]) + (std::is_unsigned_v<T> ? 1 : 0));
  }
}

/// What the tuples of an array belong to.
enum class Domain : uint8_t {
  point,   ///< one tuple per point
  corner,  ///< one tuple per entry of the connectivity, blocks one after the other
  cell,    ///< one tuple per cell, blocks one after the other
  mesh,    ///< any number of tuples, attached to the mesh as a whole
};
inline constexpr unsigned domain_count = 4;
const char* name_of(Domain domain);

/// What an array means, as far as readers could tell. Writers use it to put the array where their format
/// wants it; lossy coding uses it to choose a sensible quantisation (unit normals: octahedral).
enum class Role : uint8_t { none, normal, colour, texture_coordinate, tangent, label };
inline constexpr unsigned role_count = 6;
const char* name_of(Role role);

/// A named array of `count()` tuples of `components` numbers each, stored tuple after tuple, native byte
/// order.
struct Array {
  std::string name;
  Domain domain = Domain::point;
  Scalar type = Scalar::f32;
  uint32_t components = 1;
  Role role = Role::none;
  /// For Role::label: the value v stands for labels[v]. Empty otherwise.
  std::vector<std::string> labels;
  Buffer<std::byte> bytes;

  size_t tuple_size() const { return size_of(type) * components; }
  /// Number of tuples.
  uint64_t count() const { return components == 0 ? 0 : bytes.size() / tuple_size(); }
  /// Sets the number of tuples; new ones are zero.
  void resize(uint64_t tuples) { bytes.resize(tuples * tuple_size()); }

  /// Is T the C++ type of `type`?
  template <class T>
  bool holds() const {
    return type == scalar_of<T>();
  }
  /// The numbers, `count() * components` of them. T must be the C++ type of `type`, which builds without
  /// NDEBUG check.
  template <class T>
  std::span<const T> values() const {
    assert(holds<T>());
    return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
  }
  template <class T>
  std::span<T> values() {
    assert(holds<T>());
    return {reinterpret_cast<T*>(bytes.data()), bytes.size() / sizeof(T)};
  }
};

/// An array with the given description and no tuples; resize() makes room.
Array make_array(std::string name, Domain domain, Scalar type, uint32_t components, Role role = Role::none);

/// Cell types with VTK's numbers and VTK's order of nodes.
enum class CellType : uint8_t {
  vertex = 1,
  poly_vertex = 2,
  line = 3,
  poly_line = 4,
  triangle = 5,
  triangle_strip = 6,
  polygon = 7,
  pixel = 8,
  quad = 9,
  tetrahedron = 10,
  voxel = 11,
  hexahedron = 12,
  wedge = 13,
  pyramid = 14,
  pentagonal_prism = 15,
  hexagonal_prism = 16,
  quadratic_edge = 21,
  quadratic_triangle = 22,
  quadratic_quad = 23,
  quadratic_tetrahedron = 24,
  quadratic_hexahedron = 25,
  quadratic_wedge = 26,
  quadratic_pyramid = 27,
  biquadratic_quad = 28,
  triquadratic_hexahedron = 29,
  quadratic_linear_quad = 30,
  quadratic_linear_wedge = 31,
  biquadratic_quadratic_wedge = 32,
  biquadratic_quadratic_hexahedron = 33,
  biquadratic_triangle = 34,
  cubic_line = 35,
  quadratic_polygon = 36,
  triquadratic_pyramid = 37,
  convex_point_set = 41,
  polyhedron = 42,
  /// Any order: the number of nodes tells it.
  lagrange_curve = 68,
  lagrange_triangle = 69,
  lagrange_quad = 70,
  lagrange_tetrahedron = 71,
  lagrange_hexahedron = 72,
  lagrange_wedge = 73,
  lagrange_pyramid = 74,
  mixed = 255,  ///< not a VTK type: the block's `types` holds one type per cell
};

/// Nodes of a cell of this type; 0 when it varies from cell to cell (polygon, poly_line, mixed, ...).
unsigned nodes_of(CellType type);
/// 0 points, 1 lines, 2 faces, 3 solids; -1 for mixed, where each cell has its own.
int dimension_of(CellType type);
/// Triangle, quad or polygon: what the surface codec takes as a face.
inline bool is_face(CellType type) {
  return type == CellType::triangle || type == CellType::quad || type == CellType::polygon;
}
const char* name_of(CellType type);

/// A run of cells. `polygon` holds faces of any degree, triangles and quads included; `triangle` and `quad`
/// are the compact form for uniform blocks.
struct CellBlock {
  std::string name;
  CellType type = CellType::polygon;
  /// One type per cell when `type` is mixed; empty otherwise.
  Buffer<uint8_t> types;
  /// size() + 1 positions in `connectivity`, first 0; empty when nodes_of(type) is not 0.
  Buffer<uint64_t> offsets;
  /// Point numbers. A Mesh in memory has fewer than 2^32 points (2^32 would be 48 GB of positions alone); the
  /// number of cells and of connectivity entries has no such limit.
  Buffer<uint32_t> connectivity;

  /// Polyhedra only, otherwise both empty: the number of corners of each face, face after face, and the
  /// size() + 1 positions in it where cells begin, first 0. The entries of `connectivity` of a polyhedron are
  /// the corners of its faces, one face after the other, so a point stands there once for each face it is
  /// part of; the other cells of a mixed block have no faces here.
  Buffer<uint32_t> face_sizes = {};
  Buffer<uint64_t> cell_faces = {};

  /// Number of cells: in constant time, from offsets or from the connectivity and the nodes of the type.
  uint64_t size() const;
  /// Point numbers of one cell, in VTK's order; of a polyhedron the corners of its faces. `i` is below
  /// size(), and the block keeps the rules of validate(): nothing is checked here. Valid until the block
  /// changes.
  std::span<const uint32_t> cell(uint64_t i) const;
  CellType type_of(uint64_t i) const {
    return type == CellType::mixed ? static_cast<CellType>(types[i]) : type;
  }
  /// Corners of each face of a polyhedron; they add up to cell(i).size(). Empty for every other cell. `i` is
  /// below size().
  std::span<const uint32_t> faces(uint64_t i) const;
};

/// Largest number of points of a Mesh in memory.
inline constexpr uint64_t max_points = 0xfffffffe;

/// A mesh: points, blocks of cells over them, and arrays. Owns everything, and copying copies, but for what
/// is borrowed (Buffer::borrow()): a mesh of memory of others is encoded without a copy.
struct Mesh {
  /// Positions: domain point, 3 components, any scalar type.
  Array points = make_array("position", Domain::point, Scalar::f32, 3);
  std::vector<CellBlock> blocks;
  std::vector<Array> arrays;
  /// Key and value, in the order of the source: comments, names of files it refers to, units.
  std::vector<std::pair<std::string, std::string>> metadata;

  uint64_t point_count() const { return points.count(); }
  uint64_t cell_count() const;
  uint64_t corner_count() const;
  /// Tuples an array of this domain must have (mesh: 0, any number is fine).
  uint64_t count_of(Domain domain) const;

  /// The array of this name, not the positions; nullptr where there is none. It is gone when `arrays`
  /// changes.
  const Array* find(const std::string& name, Domain domain) const;
};

/// Checks that a mesh keeps its own rules: array sizes, offsets that never decrease and end at the
/// connectivity's end, node counts per type, faces of polyhedra, every index below point_count(). Error:
/// malformed_input, naming block, cell or array.
[[nodiscard]] Result<void> validate(const Mesh& mesh);

}  // namespace maille
