#include "drawable.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>

#include "cell_faces.h"
#include "placement.h"

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
  uint32_t flat = 0;  ///< of the list, at its front

  template <class Points>
  void add(uint32_t cell, const Points& of_face, uint64_t corner) {
    list.push_back({cell, points.size(), static_cast<uint32_t>(of_face.size()), corner});
    points.insert(points.end(), of_face.begin(), of_face.end());
  }
  std::span<const uint32_t> of(const Polygon& polygon) const {
    return std::span(points).subspan(polygon.first, polygon.size);
  }
};

/// Which faces of solids are met once, by a hash of their corners in any order: 64 bits of it are enough for
/// what is drawn, and keep a solid's faces in 9 bytes each.
class FaceTable {
 public:
  void meet(std::span<const uint32_t> points) {
    const uint64_t key = key_of(points);
    size_t at = place_of(key);
    if (keys_[at] == key) {
      times_[at] = 2;  // twice or more: the same
      return;
    }
    // Half full at most, so that runs of taken places stay short.
    if (2 * ++count_ > keys_.size()) {
      grow();
      at = place_of(key);
    }
    keys_[at] = key;
    times_[at] = 1;
  }
  bool is_single(std::span<const uint32_t> points) const { return times_[place_of(key_of(points))] == 1; }

 private:
  // The finalizer of SplitMix64 (Steele, Lea and Flood 2014). Sums of mixed numbers do not depend on the
  // order of corners.
  static uint64_t mixed(uint64_t x) {
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EB;
    return x ^ (x >> 31);
  }
  static uint64_t key_of(std::span<const uint32_t> points) {
    uint64_t sum = points.size();
    for (const uint32_t point : points) sum += mixed(point + 0x9E3779B97F4A7C15);
    return mixed(sum) | 1;  // 0: none
  }
  size_t place_of(uint64_t key) const {
    const size_t mask = keys_.size() - 1;
    size_t at = (key >> 32) & mask;
    while (keys_[at] != 0 && keys_[at] != key) at = (at + 1) & mask;
    return at;
  }
  void grow() {
    const std::vector<uint64_t> keys = std::exchange(keys_, std::vector<uint64_t>(2 * keys_.size()));
    const std::vector<uint8_t> times = std::exchange(times_, std::vector<uint8_t>(2 * times_.size()));
    for (size_t i = 0; i < keys.size(); ++i) {
      if (keys[i] == 0) continue;
      const size_t at = place_of(keys[i]);
      keys_[at] = keys[i];
      times_[at] = times[i];
    }
  }

  std::vector<uint64_t> keys_ = std::vector<uint64_t>(1024);
  std::vector<uint8_t> times_ = std::vector<uint8_t>(1024);
  size_t count_ = 0;
};

/// Calls of_solid(points, cell) and of_surface(points, cell, corner).
template <class OfSolid, class OfSurface>
void for_all_faces(const Mesh& mesh, OfSolid of_solid, OfSurface of_surface) {
  uint32_t cell = 0;
  uint64_t corner = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i, ++cell) {
      const CellType type = block.type_of(i);
      const auto sizes = type == CellType::polyhedron ? block.faces(i) : std::span<const uint32_t>();
      for_each_face(
          type, block.cell(i), sizes, [&](std::span<const uint32_t> points) { of_solid(points, cell); },
          [&](std::span<const uint32_t> points, bool whole) {
            of_surface(points, cell, whole ? corner : no_corner);
          });
      corner += block.cell(i).size();
    }
  }
}

Polygons polygons_of(const Mesh& mesh) {
  Polygons surface;
  FaceTable of_solids;
  for_all_faces(
      mesh, [&](std::span<const uint32_t> points, uint32_t) { of_solids.meet(points); },
      [&](std::span<const uint32_t> points, uint32_t cell, uint64_t corner) {
        surface.add(cell, points, corner);
      });
  surface.flat = static_cast<uint32_t>(surface.list.size());
  for_all_faces(
      mesh,
      [&](std::span<const uint32_t> points, uint32_t cell) {
        if (of_solids.is_single(points)) surface.add(cell, points, no_corner);
      },
      [](auto...) {});
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

Array array_of_vertices(const Array& array, const Vertices& vertices) {
  Array drawn = make_array(array.name, Domain::point, array.type, array.components, array.role);
  drawn.labels = array.labels;
  drawn.resize(vertices.points.size());
  const size_t size = array.tuple_size();
  for (size_t i = 0; i < vertices.points.size(); ++i) {
    const uint64_t from = array.domain == Domain::point ? vertices.points[i] : vertices.corners[i];
    if (from != no_corner) std::memcpy(drawn.bytes.data() + i * size, array.bytes.data() + from * size, size);
  }
  return drawn;
}

}  // namespace

bool is_plain(const Mesh& mesh) {
  const auto of_corners = [](const Array& array) { return array.domain == Domain::corner; };
  return mesh.blocks.size() == 1 && mesh.blocks[0].type == CellType::triangle &&
         std::none_of(mesh.arrays.begin(), mesh.arrays.end(), of_corners);
}

Drawable draw(const Mesh& mesh, const std::optional<Vector3>& origin) {
  const Polygons polygons = polygons_of(mesh);
  const Vertices vertices(mesh, polygons);
  Drawable drawable;
  drawable.flat_faces = polygons.flat;
  drawable.points = vertices.points;
  drawable.positions.resize(3 * drawable.points.size());
  drawable.origin = place(mesh.points, drawable.points, origin, drawable.positions);
  for (const Polygon& polygon : polygons.list) {
    drawable.faces.push_back(static_cast<uint32_t>(drawable.cells.size()));
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

void spread_cell_arrays(const Mesh& mesh, Drawable& drawable) {
  for (const Array& array : mesh.arrays) {
    if (array.domain != Domain::cell) continue;
    Array spread = make_array(array.name, Domain::cell, array.type, array.components, array.role);
    spread.labels = array.labels;
    spread.resize(drawable.cells.size());
    const size_t size = array.tuple_size();
    for (size_t i = 0; i < drawable.cells.size(); ++i)
      std::memcpy(spread.bytes.data() + i * size, array.bytes.data() + drawable.cells[i] * size, size);
    drawable.of_triangles.push_back(std::move(spread));
  }
}

}  // namespace maille::wasm
