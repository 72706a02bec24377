#include <maille/mesh.h>

#include <array>
#include <numeric>
#include <string>

namespace maille {

size_t size_of(Scalar type) {
  static constexpr size_t sizes[scalar_count] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return sizes[static_cast<size_t>(type)];
}

const char* name_of(Scalar type) {
  static constexpr const char* names[scalar_count] = {"i8",  "u8",  "i16", "u16", "i32",
                                                      "u32", "i64", "u64", "f32", "f64"};
  return names[static_cast<size_t>(type)];
}

const char* name_of(Domain domain) {
  static constexpr const char* names[domain_count] = {"point", "corner", "cell", "mesh"};
  return names[static_cast<size_t>(domain)];
}

const char* name_of(Role role) {
  static constexpr const char* names[role_count] = {"none",    "normal", "colour", "texture_coordinate",
                                                    "tangent", "label"};
  return names[static_cast<size_t>(role)];
}

Array make_array(std::string name, Domain domain, Scalar type, uint32_t components, Role role) {
  Array array;
  array.name = std::move(name);
  array.domain = domain;
  array.type = type;
  array.components = components;
  array.role = role;
  return array;
}

namespace {

/// VTK's types and names. 0 nodes: the number is the cell's own.
struct CellTypeInfo {
  CellType type;
  unsigned nodes;
  const char* name;
};

constexpr CellTypeInfo cell_types[] = {
    {CellType::vertex, 1, "vertex"},
    {CellType::poly_vertex, 0, "poly_vertex"},
    {CellType::line, 2, "line"},
    {CellType::poly_line, 0, "poly_line"},
    {CellType::triangle, 3, "triangle"},
    {CellType::triangle_strip, 0, "triangle_strip"},
    {CellType::polygon, 0, "polygon"},
    {CellType::pixel, 4, "pixel"},
    {CellType::quad, 4, "quad"},
    {CellType::tetrahedron, 4, "tetrahedron"},
    {CellType::voxel, 8, "voxel"},
    {CellType::hexahedron, 8, "hexahedron"},
    {CellType::wedge, 6, "wedge"},
    {CellType::pyramid, 5, "pyramid"},
    {CellType::pentagonal_prism, 10, "pentagonal_prism"},
    {CellType::hexagonal_prism, 12, "hexagonal_prism"},
    {CellType::quadratic_edge, 3, "quadratic_edge"},
    {CellType::quadratic_triangle, 6, "quadratic_triangle"},
    {CellType::quadratic_quad, 8, "quadratic_quad"},
    {CellType::quadratic_tetrahedron, 10, "quadratic_tetrahedron"},
    {CellType::quadratic_hexahedron, 20, "quadratic_hexahedron"},
    {CellType::quadratic_wedge, 15, "quadratic_wedge"},
    {CellType::quadratic_pyramid, 13, "quadratic_pyramid"},
    {CellType::biquadratic_quad, 9, "biquadratic_quad"},
    {CellType::triquadratic_hexahedron, 27, "triquadratic_hexahedron"},
    {CellType::quadratic_linear_quad, 6, "quadratic_linear_quad"},
    {CellType::quadratic_linear_wedge, 12, "quadratic_linear_wedge"},
    {CellType::biquadratic_quadratic_wedge, 18, "biquadratic_quadratic_wedge"},
    {CellType::biquadratic_quadratic_hexahedron, 24, "biquadratic_quadratic_hexahedron"},
    {CellType::biquadratic_triangle, 7, "biquadratic_triangle"},
    {CellType::cubic_line, 4, "cubic_line"},
    {CellType::quadratic_polygon, 0, "quadratic_polygon"},
    {CellType::triquadratic_pyramid, 19, "triquadratic_pyramid"},
    {CellType::convex_point_set, 0, "convex_point_set"},
    {CellType::polyhedron, 0, "polyhedron"},
    {CellType::lagrange_curve, 0, "lagrange_curve"},
    {CellType::lagrange_triangle, 0, "lagrange_triangle"},
    {CellType::lagrange_quad, 0, "lagrange_quad"},
    {CellType::lagrange_tetrahedron, 0, "lagrange_tetrahedron"},
    {CellType::lagrange_hexahedron, 0, "lagrange_hexahedron"},
    {CellType::lagrange_wedge, 0, "lagrange_wedge"},
    {CellType::lagrange_pyramid, 0, "lagrange_pyramid"},
    {CellType::mixed, 0, "mixed"},
};

/// A pass over some forty entries. nodes_of() has a table, as codecs ask it for each cell.
const CellTypeInfo* find_type(CellType type) {
  for (const CellTypeInfo& info : cell_types) {
    if (info.type == type) return &info;
  }
  return nullptr;
}

/// Checks one cell of a block of mixed types.
Result<> check_nodes(const CellBlock& block, uint64_t cell, uint64_t nodes, const std::string& where) {
  const CellType type = block.type_of(cell);
  const CellTypeInfo* info = find_type(type);
  if (!info || type == CellType::mixed) {
    return failure(ErrorCode::malformed_input, where + ": cell " + std::to_string(cell) +
                                                   " has the unknown type " +
                                                   std::to_string(static_cast<unsigned>(type)));
  }
  if (info->nodes != 0 && info->nodes != nodes) {
    return failure(ErrorCode::malformed_input, where + ": cell " + std::to_string(cell) + " (" + info->name +
                                                   ") has " + std::to_string(nodes) + " nodes instead of " +
                                                   std::to_string(info->nodes));
  }
  return {};
}

/// Afterwards cell(i) lies within the connectivity for every cell, so all later checks may use it.
Result<> check_offsets(const CellBlock& block, const std::string& where) {
  const auto bad = [&](const std::string& what) {
    return failure(ErrorCode::malformed_input, where + ": " + what);
  };
  const unsigned nodes = nodes_of(block.type);
  if (nodes != 0) {
    if (!block.offsets.empty()) return bad("a type with a fixed number of nodes takes no offsets");
    if (block.connectivity.size() % nodes != 0)
      return bad("connectivity is not a multiple of the nodes per cell");
    return {};
  }
  if (block.offsets.empty()) {
    return block.connectivity.empty() ? Result<>{} : bad("offsets are missing");
  }
  // With these two ends, offsets that never go backwards (below) keep each cell within the connectivity.
  if (block.offsets.front() != 0 || block.offsets.back() != block.connectivity.size()) {
    return bad("offsets must run from 0 to the size of the connectivity");
  }
  if (block.type == CellType::mixed && block.types.size() != block.size())
    return bad("one type per cell is needed");
  for (uint64_t i = 0; i < block.size(); ++i) {
    if (block.offsets[i + 1] < block.offsets[i])
      return bad("offset " + std::to_string(i + 1) + " goes backwards");
    if (block.type == CellType::mixed) {
      if (auto ok = check_nodes(block, i, block.offsets[i + 1] - block.offsets[i], where); !ok) return ok;
    }
  }
  return {};
}

/// The faces of polyhedra take up exactly their corners; other cells have none.
Result<> check_faces(const CellBlock& block, const std::string& where) {
  const auto bad = [&](const std::string& what) {
    return failure(ErrorCode::malformed_input, where + ": " + what);
  };
  const bool varies = block.type == CellType::polyhedron || block.type == CellType::mixed;
  const bool listed = !block.cell_faces.empty();
  if (!listed && !block.face_sizes.empty()) return bad("faces of polyhedra without the cells they belong to");
  if (!varies) return listed ? bad("only polyhedra have faces") : Result<>{};
  if (listed && (block.cell_faces.size() != block.size() + 1 || block.cell_faces.front() != 0 ||
                 block.cell_faces.back() != block.face_sizes.size())) {
    return bad("the cells' faces must run from 0 to the number of faces");
  }
  for (uint64_t i = 0; i < block.size(); ++i) {
    const bool polyhedron = block.type_of(i) == CellType::polyhedron;
    if (!listed) {
      if (polyhedron) return bad("cell " + std::to_string(i) + " is a polyhedron without faces");
      continue;
    }
    // Before faces(i) is used: it would reach beyond the end.
    if (block.cell_faces[i + 1] < block.cell_faces[i] || block.cell_faces[i + 1] > block.face_sizes.size()) {
      return bad("the faces of cell " + std::to_string(i) + " end before they begin or beyond the last");
    }
    const auto faces = block.faces(i);
    // The sum needs 64 bits: sizes are any numbers of 32 bits here, and their sum must not wrap around to the
    // right one.
    const uint64_t corners = std::accumulate(faces.begin(), faces.end(), uint64_t{0});
    if (corners != (polyhedron ? block.cell(i).size() : 0)) {
      return bad("the faces of cell " + std::to_string(i) + " have " + std::to_string(corners) +
                 " corners, not those of the cell");
    }
  }
  return {};
}

Result<> check_block(const CellBlock& block, uint64_t points, const std::string& where) {
  if (!find_type(block.type)) {
    return failure(ErrorCode::malformed_input,
                   where + " has the unknown type " + std::to_string(static_cast<unsigned>(block.type)));
  }
  if (auto ok = check_offsets(block, where); !ok) return ok;
  if (auto ok = check_faces(block, where); !ok) return ok;
  // Which cell an entry belongs to does not matter for this, so it is one pass over the numbers, whatever the
  // type of the block.
  for (size_t i = 0; i < block.connectivity.size(); ++i) {
    if (block.connectivity[i] >= points) {
      return failure(ErrorCode::malformed_input, where + ": connectivity entry " + std::to_string(i) +
                                                     " is point " + std::to_string(block.connectivity[i]) +
                                                     ", but there are " + std::to_string(points) + " points");
    }
  }
  return {};
}

/// Memory that is borrowed may lie anywhere.
Result<> check_alignment(const Array& array, const std::string& where) {
  const size_t size = size_of(array.type);
  if (reinterpret_cast<uintptr_t>(array.bytes.data()) % size == 0) return {};
  return failure(ErrorCode::malformed_input, where + ": numbers of type " + name_of(array.type) +
                                                 " must lie at a multiple of " + std::to_string(size) +
                                                 " in memory; copy them");
}

Result<> check_array(const Array& array, const Mesh& mesh) {
  const std::string where = "array \"" + array.name + "\" on " + name_of(array.domain) + "s";
  if (array.components == 0) return failure(ErrorCode::malformed_input, where + " has no components");
  if (array.bytes.size() % array.tuple_size() != 0) {
    return failure(ErrorCode::malformed_input, where + " ends inside a tuple");
  }
  if (array.domain != Domain::mesh && array.count() != mesh.count_of(array.domain)) {
    return failure(ErrorCode::malformed_input, where + " has " + std::to_string(array.count()) +
                                                   " tuples instead of " +
                                                   std::to_string(mesh.count_of(array.domain)));
  }
  return check_alignment(array, where);
}

}  // namespace

// A table, since this is asked for each cell of mixed blocks.
unsigned nodes_of(CellType type) {
  static constexpr auto table = [] {
    std::array<uint8_t, 256> nodes{};
    for (const CellTypeInfo& info : cell_types)
      nodes[static_cast<uint8_t>(info.type)] = static_cast<uint8_t>(info.nodes);
    return nodes;
  }();
  return table[static_cast<uint8_t>(type)];
}

// Types that are not named here are solids. A mixed block has no dimension of its own: -1.
int dimension_of(CellType type) {
  switch (type) {
    case CellType::vertex:
    case CellType::poly_vertex:
      return 0;
    case CellType::line:
    case CellType::poly_line:
    case CellType::quadratic_edge:
    case CellType::cubic_line:
    case CellType::lagrange_curve:
      return 1;
    case CellType::triangle:
    case CellType::triangle_strip:
    case CellType::polygon:
    case CellType::pixel:
    case CellType::quad:
    case CellType::quadratic_triangle:
    case CellType::quadratic_quad:
    case CellType::biquadratic_quad:
    case CellType::quadratic_linear_quad:
    case CellType::biquadratic_triangle:
    case CellType::quadratic_polygon:
    case CellType::lagrange_triangle:
    case CellType::lagrange_quad:
      return 2;
    case CellType::mixed:
      return -1;
    default:
      return 3;
  }
}

const char* name_of(CellType type) {
  const CellTypeInfo* info = find_type(type);
  return info ? info->name : "unknown";
}

uint64_t CellBlock::size() const {
  const unsigned nodes = nodes_of(type);
  if (nodes != 0) return connectivity.size() / nodes;
  return offsets.empty() ? 0 : offsets.size() - 1;
}

std::span<const uint32_t> CellBlock::cell(uint64_t i) const {
  const unsigned nodes = nodes_of(type);
  if (nodes != 0) return std::span(connectivity).subspan(i * nodes, nodes);
  return std::span(connectivity).subspan(offsets[i], offsets[i + 1] - offsets[i]);
}

// A block without polyhedra has no lists of faces at all.
std::span<const uint32_t> CellBlock::faces(uint64_t i) const {
  if (cell_faces.empty()) return {};
  return std::span(face_sizes).subspan(cell_faces[i], cell_faces[i + 1] - cell_faces[i]);
}

uint64_t Mesh::cell_count() const {
  uint64_t count = 0;
  for (const CellBlock& block : blocks) count += block.size();
  return count;
}

uint64_t Mesh::corner_count() const {
  uint64_t count = 0;
  for (const CellBlock& block : blocks) count += block.connectivity.size();
  return count;
}

uint64_t Mesh::count_of(Domain domain) const {
  switch (domain) {
    case Domain::point:
      return point_count();
    case Domain::corner:
      return corner_count();
    case Domain::cell:
      return cell_count();
    // Arrays of the whole mesh may have any number of tuples; nobody may rely on a count.
    case Domain::mesh:
      break;
  }
  return 0;
}

const Array* Mesh::find(const std::string& name, Domain domain) const {
  for (const Array& array : arrays) {
    if (array.domain == domain && array.name == name) return &array;
  }
  return nullptr;
}

// Each check relies on those before it: first tuples, then offsets, faces, and what the numbers point to.
Result<> validate(const Mesh& mesh) {
  if (mesh.points.components != 3 || mesh.points.bytes.size() % mesh.points.tuple_size() != 0) {
    return failure(ErrorCode::malformed_input, "positions must have 3 components");
  }
  if (mesh.point_count() > max_points) {
    return failure(ErrorCode::malformed_input, "a mesh in memory has at most 2^32 - 2 points");
  }
  if (auto ok = check_alignment(mesh.points, "positions"); !ok) return ok;
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    if (auto ok = check_block(mesh.blocks[b], mesh.point_count(), "block " + std::to_string(b)); !ok)
      return ok;
  }
  for (const Array& array : mesh.arrays) {
    if (auto ok = check_array(array, mesh); !ok) return ok;
  }
  return {};
}

}  // namespace maille
