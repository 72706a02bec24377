#include "surface_triangles.h"

#include <maille/faces.h>

#include <algorithm>
#include <array>
#include <span>
#include <tuple>
#include <utility>

namespace maille::python {

namespace {

/// Corners of a face of any type, without the points between them; 0: all points are corners.
size_t corners_of(CellType type) {
  switch (type) {
    case CellType::quadratic_triangle:
    case CellType::biquadratic_triangle:
    case CellType::lagrange_triangle:
      return 3;
    case CellType::quadratic_quad:
    case CellType::biquadratic_quad:
    case CellType::quadratic_linear_quad:
    case CellType::lagrange_quad:
      return 4;
    default:
      return 0;
  }
}

/// A face of a solid among all faces. Two solids share a face if its points are the same; comparing the three
/// lowest points is enough, as two faces of a conforming mesh that have three points in common are the same
/// face.
struct Face {
  std::array<uint32_t, 3> lowest;  ///< points of it, rising: two faces of a mesh with these are one
  uint64_t cell = 0;
  uint64_t first = 0;  ///< of its corners, in `corners`
  uint32_t size = 0;
};

class Collector {
 public:
  explicit Collector(const Mesh& mesh) {
    uint64_t number = 0;
    for (const CellBlock& block : mesh.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i) add(block, i, number++);
    }
    add_borders();
  }
  SurfaceTriangles take() { return std::move(found_); }

 private:
  void add(const CellBlock& block, uint64_t i, uint64_t number) {
    const CellType type = block.type_of(i);
    const auto points = block.cell(i);
    if (type == CellType::polyhedron) {
      size_t at = 0;
      for (const uint32_t size : block.faces(i)) {
        add_face(points.subspan(at, size), number);
        at += size;
      }
    } else if (type == CellType::triangle_strip) {
      for (size_t k = 0; k + 2 < points.size(); ++k) {
        // Every other triangle of a strip runs the other way round.
        const bool turned = k % 2 == 1;
        add_triangle(points[k], points[k + (turned ? 2 : 1)], points[k + (turned ? 1 : 2)], number);
      }
    } else if (type == CellType::pixel) {
      // VTK numbers the corners of a pixel row by row, not around it.
      const std::array<uint32_t, 4> around = {points[0], points[1], points[3], points[2]};
      add_fan(around, number);
    } else if (dimension_of(type) == 2) {
      add_polygon(type, points, number);
    } else {
      add_solid(type, points, number);
    }
  }

  void add_polygon(CellType type, std::span<const uint32_t> points, uint64_t number) {
    size_t corners = corners_of(type);
    if (type == CellType::quadratic_polygon) corners = points.size() / 2;
    add_fan(corners == 0 ? points : points.first(std::min(corners, points.size())), number);
  }

  void add_solid(CellType type, std::span<const uint32_t> points, uint64_t number) {
    const FacesOfSolid& faces = faces_of(type);
    std::array<uint32_t, 6> corners{};
    for (unsigned f = 0; f < faces.count; ++f) {
      const auto nodes = faces.face(f);
      for (size_t k = 0; k < nodes.size(); ++k) corners[k] = points[nodes[k]];
      add_face(std::span<const uint32_t>(corners).first(nodes.size()), number);
    }
  }

  void add_fan(std::span<const uint32_t> points, uint64_t cell) {
    for (size_t k = 2; k < points.size(); ++k) add_triangle(points[0], points[k - 1], points[k], cell);
  }

  void add_triangle(uint32_t a, uint32_t b, uint32_t c, uint64_t cell) {
    found_.corners.insert(found_.corners.end(), {a, b, c});
    found_.cells.push_back(cell);
  }

  void add_face(std::span<const uint32_t> points, uint64_t cell) {
    if (points.size() < 3) return;
    std::array<uint32_t, 3> lowest;
    std::partial_sort_copy(points.begin(), points.end(), lowest.begin(), lowest.end());
    faces_.push_back({lowest, cell, corners_.size(), static_cast<uint32_t>(points.size())});
    corners_.insert(corners_.end(), points.begin(), points.end());
  }

  /// Adds the faces that exist once, in the order of their cells. Sorting finds equal faces without a hash
  /// table, so the result does not depend on hashing; `first` makes the order total.
  void add_borders() {
    const auto same = [](const Face& a, const Face& b) { return a.lowest == b.lowest && a.size == b.size; };
    std::sort(faces_.begin(), faces_.end(), [](const Face& a, const Face& b) {
      return std::tie(a.lowest, a.size, a.first) < std::tie(b.lowest, b.size, b.first);
    });
    std::vector<Face> borders;
    for (size_t i = 0; i < faces_.size();) {
      size_t end = i + 1;
      while (end < faces_.size() && same(faces_[i], faces_[end])) ++end;
      if (end == i + 1) borders.push_back(faces_[i]);
      i = end;
    }
    std::sort(borders.begin(), borders.end(), [](const Face& a, const Face& b) { return a.first < b.first; });
    for (const Face& face : borders)
      add_fan(std::span<const uint32_t>(corners_).subspan(face.first, face.size), face.cell);
  }

  SurfaceTriangles found_;
  std::vector<Face> faces_;
  std::vector<uint32_t> corners_;
};

}  // namespace

SurfaceTriangles surface_triangles(const Mesh& mesh) {
  return Collector(mesh).take();
}

}  // namespace maille::python
