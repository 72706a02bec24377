#include "drawable.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <numeric>

namespace maille::wasm {
namespace {

constexpr uint64_t no_corner = std::numeric_limits<uint64_t>::max();

/// A polygon to be shown, by its points. Corners are places in the connectivity of the mesh, where that is a
/// face of the surface itself.
struct Polygon {
  uint32_t cell = 0;
  uint64_t first = 0;  ///< in Polygons::points
  uint32_t size = 0;
  uint64_t corner = no_corner;
};

struct Polygons {
  std::vector<Polygon> list;
  std::vector<uint32_t> points;

  template <class Points>
  void add(uint32_t cell, const Points& of_face, uint64_t corner) {
    list.push_back({cell, points.size(), static_cast<uint32_t>(of_face.size()), corner});
    points.insert(points.end(), of_face.begin(), of_face.end());
  }
  std::span<const uint32_t> of(const Polygon& polygon) const {
    return std::span(points).subspan(polygon.first, polygon.size);
  }
};

/// Faces of a solid, by nodes in VTK's order; outwards.
using FaceNodes = std::vector<std::vector<uint8_t>>;
const FaceNodes& faces_of(CellType type) {
  static const FaceNodes tetrahedron = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 2, 1}};
  static const FaceNodes pyramid = {{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  static const FaceNodes wedge = {{0, 1, 2}, {3, 5, 4}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}};
  static const FaceNodes hexahedron = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                                       {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}};
  static const FaceNodes voxel = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                  {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  static const FaceNodes none;
  switch (type) {
    case CellType::tetrahedron:
    case CellType::quadratic_tetrahedron:
      return tetrahedron;
    case CellType::pyramid:
    case CellType::quadratic_pyramid:
    case CellType::triquadratic_pyramid:
      return pyramid;
    case CellType::wedge:
    case CellType::quadratic_wedge:
    case CellType::quadratic_linear_wedge:
    case CellType::biquadratic_quadratic_wedge:
      return wedge;
    case CellType::hexahedron:
    case CellType::quadratic_hexahedron:
    case CellType::triquadratic_hexahedron:
    case CellType::biquadratic_quadratic_hexahedron:
      return hexahedron;
    case CellType::voxel:
      return voxel;
    default:
      return none;
  }
}

/// The corners of a face in a ring, which curved faces and pixels do not have first.
unsigned corners_of(CellType type, size_t nodes) {
  switch (type) {
    case CellType::quadratic_triangle:
    case CellType::biquadratic_triangle:
      return 3;
    case CellType::pixel:
    case CellType::quadratic_quad:
    case CellType::biquadratic_quad:
    case CellType::quadratic_linear_quad:
      return 4;
    default:
      return static_cast<unsigned>(nodes);
  }
}

void add_faces(const CellBlock& block, uint64_t i, uint32_t cell, uint64_t corner, Polygons& surface,
               Polygons& of_solids) {
  const CellType type = block.type_of(i);
  const std::span<const uint32_t> nodes = block.cell(i);
  std::vector<uint32_t> face;
  if (type == CellType::polyhedron) {
    size_t at = 0;
    for (const uint32_t size : block.faces(i)) {
      of_solids.add(cell, nodes.subspan(at, size), no_corner);
      at += size;
    }
  } else if (dimension_of(type) == 3) {
    for (const auto& places : faces_of(type)) {
      face.clear();
      for (const uint8_t place : places) face.push_back(nodes[place]);
      of_solids.add(cell, face, no_corner);
    }
  } else if (type == CellType::pixel) {
    surface.add(cell, std::array{nodes[0], nodes[1], nodes[3], nodes[2]}, no_corner);
  } else if (type == CellType::triangle_strip) {
    for (size_t k = 2; k < nodes.size(); ++k) {
      const bool turned = k % 2 == 1;
      surface.add(cell, std::array{nodes[k - 2 + turned], nodes[k - 1 - turned], nodes[k]}, no_corner);
    }
  } else if (dimension_of(type) == 2) {
    surface.add(cell, nodes.first(corners_of(type, nodes.size())), corner);
  }
}

/// Of the faces of solids those that stand there once.
void keep_boundary(const Polygons& of_solids, Polygons& surface) {
  std::vector<uint32_t> sorted(of_solids.points);
  for (const Polygon& polygon : of_solids.list) {
    const auto begin = sorted.begin() + static_cast<ptrdiff_t>(polygon.first);
    std::sort(begin, begin + polygon.size);
  }
  const auto key = [&](uint32_t i) {
    return std::span<const uint32_t>(sorted).subspan(of_solids.list[i].first, of_solids.list[i].size);
  };
  const auto compare = [&](uint32_t a, uint32_t b) {
    const auto left = key(a), right = key(b);
    if (left.size() != right.size()) return left.size() < right.size() ? -1 : 1;
    for (size_t k = 0; k < left.size(); ++k) {
      if (left[k] != right[k]) return left[k] < right[k] ? -1 : 1;
    }
    return 0;
  };
  std::vector<uint32_t> order(of_solids.list.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const int differs = compare(a, b);
    return differs != 0 ? differs < 0 : a < b;
  });
  std::vector<uint32_t> single;
  for (size_t i = 0, end = 0; i < order.size(); i = end) {
    for (end = i + 1; end < order.size() && compare(order[i], order[end]) == 0;) ++end;
    if (end == i + 1) single.push_back(order[i]);
  }
  std::sort(single.begin(), single.end());
  for (const uint32_t i : single)
    surface.add(of_solids.list[i].cell, of_solids.of(of_solids.list[i]), no_corner);
}

Polygons polygons_of(const Mesh& mesh) {
  Polygons surface, of_solids;
  uint32_t cell = 0;
  uint64_t corner = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i, ++cell) {
      add_faces(block, i, cell, corner, surface, of_solids);
      corner += block.cell(i).size();
    }
  }
  keep_boundary(of_solids, surface);
  return surface;
}

/// Vertices: what a point is where all corner arrays agree.
class Vertices {
 public:
  Vertices(const Mesh& mesh, const Polygons& polygons) {
    for (const Array& array : mesh.arrays) {
      if (array.domain == Domain::corner && array.count() > 0) corner_arrays_.push_back(&array);
    }
    std::vector<uint32_t> order(polygons.points.size());
    std::iota(order.begin(), order.end(), 0u);
    corner_.assign(polygons.points.size(), no_corner);
    for (const Polygon& polygon : polygons.list) {
      for (uint32_t k = 0; k < polygon.size && polygon.corner != no_corner; ++k) {
        corner_[polygon.first + k] = polygon.corner + k;
      }
    }
    const auto compare = [&](uint32_t a, uint32_t b) {
      if (polygons.points[a] != polygons.points[b]) return polygons.points[a] < polygons.points[b] ? -1 : 1;
      return compare_corners(corner_[a], corner_[b]);
    };
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      const int differs = compare(a, b);
      return differs != 0 ? differs < 0 : a < b;
    });
    of_place.resize(order.size());
    for (size_t i = 0; i < order.size(); ++i) {
      if (i == 0 || compare(order[i - 1], order[i]) != 0) {
        points.push_back(polygons.points[order[i]]);
        corners.push_back(corner_[order[i]]);
      }
      of_place[order[i]] = static_cast<uint32_t>(points.size() - 1);
    }
  }

  std::vector<uint32_t> points;    ///< by vertex
  std::vector<uint64_t> corners;   ///< by vertex: one that it is
  std::vector<uint32_t> of_place;  ///< by place in Polygons::points

 private:
  int compare_corners(uint64_t a, uint64_t b) const {
    if (a == no_corner || b == no_corner) return (a == no_corner) - (b == no_corner);
    for (const Array* array : corner_arrays_) {
      const size_t size = array->tuple_size();
      const int differs = std::memcmp(array->bytes.data() + a * size, array->bytes.data() + b * size, size);
      if (differs != 0) return differs;
    }
    return 0;
  }

  std::vector<const Array*> corner_arrays_;
  std::vector<uint64_t> corner_;
};

template <class T>
double number_at(const Array& array, uint64_t i) {
  T value;
  std::memcpy(&value, array.bytes.data() + i * sizeof(T), sizeof(T));
  return static_cast<double>(value);
}

double value_at(const Array& array, uint64_t i) {
  switch (array.type) {
    case Scalar::i8:
      return number_at<int8_t>(array, i);
    case Scalar::u8:
      return number_at<uint8_t>(array, i);
    case Scalar::i16:
      return number_at<int16_t>(array, i);
    case Scalar::u16:
      return number_at<uint16_t>(array, i);
    case Scalar::i32:
      return number_at<int32_t>(array, i);
    case Scalar::u32:
      return number_at<uint32_t>(array, i);
    case Scalar::i64:
      return number_at<int64_t>(array, i);
    case Scalar::u64:
      return number_at<uint64_t>(array, i);
    case Scalar::f32:
      return number_at<float>(array, i);
    case Scalar::f64:
      return number_at<double>(array, i);
  }
  return 0;
}

void place_vertices(const Mesh& mesh, const std::optional<Vector3>& origin, Drawable& drawable) {
  const uint32_t components = std::min<uint32_t>(mesh.points.components, 3);
  if (origin) {
    drawable.origin = *origin;
  } else if (!drawable.points.empty()) {
    for (uint32_t k = 0; k < components; ++k) {
      const double value = value_at(mesh.points, uint64_t{drawable.points[0]} * mesh.points.components + k);
      // Not finite: then nothing is.
      drawable.origin[k] = value - value == 0 ? value : 0;
    }
  }
  drawable.positions.assign(drawable.points.size() * 3, 0.f);
  for (size_t i = 0; i < drawable.points.size(); ++i) {
    for (uint32_t k = 0; k < components; ++k) {
      const double value = value_at(mesh.points, uint64_t{drawable.points[i]} * mesh.points.components + k);
      drawable.positions[i * 3 + k] = static_cast<float>(value - drawable.origin[k]);
    }
  }
}

Array array_of_vertices(const Array& array, const Vertices& vertices) {
  Array drawn = make_array(array.name, Domain::point, array.type, array.components, array.role);
  drawn.resize(vertices.points.size());
  const size_t size = array.tuple_size();
  for (size_t i = 0; i < vertices.points.size(); ++i) {
    const uint64_t from = array.domain == Domain::point ? vertices.points[i] : vertices.corners[i];
    if (from != no_corner) std::memcpy(drawn.bytes.data() + i * size, array.bytes.data() + from * size, size);
  }
  return drawn;
}

bool is_plain(const Mesh& mesh) {
  const auto of_triangles = [](const CellBlock& block) { return block.type == CellType::triangle; };
  const auto of_corners = [](const Array& array) { return array.domain == Domain::corner; };
  return std::all_of(mesh.blocks.begin(), mesh.blocks.end(), of_triangles) &&
         std::none_of(mesh.arrays.begin(), mesh.arrays.end(), of_corners);
}

/// Triangles whose corners have nothing of their own: most charts.
Drawable draw_plain(const Mesh& mesh, const std::optional<Vector3>& origin) {
  Drawable drawable;
  drawable.points.resize(mesh.point_count());
  std::iota(drawable.points.begin(), drawable.points.end(), 0u);
  place_vertices(mesh, origin, drawable);
  for (const CellBlock& block : mesh.blocks) {
    drawable.triangles.insert(drawable.triangles.end(), block.connectivity.begin(), block.connectivity.end());
  }
  drawable.cells.resize(drawable.triangles.size() / 3);
  std::iota(drawable.cells.begin(), drawable.cells.end(), 0u);
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::point) drawable.arrays.push_back(array);
  }
  return drawable;
}

}  // namespace

Drawable draw(const Mesh& mesh, const std::optional<Vector3>& origin) {
  if (is_plain(mesh)) return draw_plain(mesh, origin);
  const Polygons polygons = polygons_of(mesh);
  const Vertices vertices(mesh, polygons);
  Drawable drawable;
  drawable.points = vertices.points;
  place_vertices(mesh, origin, drawable);
  for (const Polygon& polygon : polygons.list) {
    for (uint32_t k = 2; k < polygon.size; ++k) {
      for (const uint32_t corner : {0u, k - 1, k}) {
        drawable.triangles.push_back(vertices.of_place[polygon.first + corner]);
      }
      drawable.cells.push_back(polygon.cell);
    }
  }
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::point || array.domain == Domain::corner)
      drawable.arrays.push_back(array_of_vertices(array, vertices));
  }
  return drawable;
}

}  // namespace maille::wasm
