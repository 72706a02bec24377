// From the lists and dimensions of a legacy VTK file to cells, and to the points of grids.
#include "io/buffered_writer.h"
#include "io/format.h"
#include "io/vtk/vtk_legacy_reader.h"

namespace maille {

Result<> VtkLegacyReader::add_nodes(std::span<const int64_t> nodes) {
  for (const int64_t node : nodes) {
    if (node < 0 || static_cast<uint64_t>(node) >= mesh_.point_count()) {
      return failure(ErrorCode::malformed_input, in_.name() + ": cell " + std::to_string(store_.count()) +
                                                     " uses point " + std::to_string(node) +
                                                     ", but there are " +
                                                     std::to_string(mesh_.point_count()) + " points");
    }
    store_.nodes.push_back(static_cast<uint32_t>(node));
  }
  return {};
}

Result<> VtkLegacyReader::finish_unstructured() {
  if (types_.size() != cells_.count()) {
    return in_.malformed("there are " + std::to_string(cells_.count()) + " cells but types of " +
                         std::to_string(types_.size()));
  }
  for (uint64_t i = 0; i < cells_.count(); ++i) {
    // 255 is no type; validate() refuses it with the cell's number.
    const auto type = static_cast<CellType>(types_[i] < 0 || types_[i] > 254 ? 255 : types_[i]);
    std::span<const int64_t> list = cells_.cell(i);
    if (type == CellType::polyhedron) {
      const auto bad = [&] {
        return in_.malformed("the faces of cell " + std::to_string(i) +
                             ", a polyhedron, end too early or too late");
      };
      if (list.empty()) return bad();
      int64_t faces = list[0];
      // Each face takes an entry of the list at least, so a claimed number ends with the list.
      for (list = list.subspan(1); faces > 0; --faces) {
        if (list.empty() || list[0] < 0 || static_cast<uint64_t>(list[0]) > list.size() - 1) return bad();
        const auto size = static_cast<size_t>(list[0]);
        MAILLE_CHECK(add_nodes(list.subspan(1, size)));
        store_.face_sizes.push_back(static_cast<uint32_t>(size));
        list = list.subspan(size + 1);
      }
      if (!list.empty()) return bad();
    } else {
      MAILLE_CHECK(add_nodes(list));
    }
    store_.end_cell(type);
  }
  return {};
}

/// Adds cells of `single` number of nodes each, or of any. Poly data has no types: where all cells have the
/// nodes of the simple type it is that, so triangles come back as triangles.
Result<> VtkLegacyReader::add_poly_data(const Cells& cells, CellType single, CellType varying) {
  const auto all = [&](unsigned nodes) {
    for (uint64_t i = 0; i < cells.count(); ++i) {
      if (cells.cell(i).size() != nodes) return false;
    }
    return true;
  };
  CellType type = all(nodes_of(single)) ? single : varying;
  if (type == CellType::polygon && all(4)) type = CellType::quad;
  for (uint64_t i = 0; i < cells.count(); ++i) {
    MAILLE_CHECK(add_nodes(cells.cell(i)));
    store_.end_cell(type);
  }
  return {};
}

// Points in VTK's order: x fastest, then y. In doubles, as origin and spacing are.
Result<> VtkLegacyReader::make_grid_points() {
  // Each dimension is below 2^32, so the first product fits, and it is compared before the second.
  const uint64_t points = static_cast<uint64_t>(dimensions_[0]) * static_cast<uint64_t>(dimensions_[1]);
  if (points > max_points || points * static_cast<uint64_t>(dimensions_[2]) > max_points) {
    return in_.malformed("the grid has 2^32 points or more");
  }
  MAILLE_CHECK(budget_.take(points * static_cast<uint64_t>(dimensions_[2]), 3 * sizeof(double)));
  mesh_.points.type = Scalar::f64;
  mesh_.points.resize(points * static_cast<uint64_t>(dimensions_[2]));
  const auto coordinate = [&](size_t axis, int64_t i) {
    if (shape_ == Shape::image) return origin_[axis] + spacing_[axis] * static_cast<double>(i);
    const Array& values = coordinates_[axis];
    return with_type(values.type, [&](auto zero) {
      return static_cast<double>(values.values<decltype(zero)>()[static_cast<size_t>(i)]);
    });
  };
  double* to = mesh_.points.values<double>().data();
  for (int64_t k = 0; k < dimensions_[2]; ++k) {
    for (int64_t j = 0; j < dimensions_[1]; ++j) {
      for (int64_t i = 0; i < dimensions_[0]; ++i, to += 3) {
        to[0] = coordinate(0, i);
        to[1] = coordinate(1, j);
        to[2] = coordinate(2, k);
      }
    }
  }
  return {};
}

/// Makes the cells of a grid: hexahedra, or quads, lines or a vertex where the grid is thin.
Result<> VtkLegacyReader::finish_grid() {
  if (dimensions_[0] == 0) return in_.malformed("there are no DIMENSIONS");
  for (size_t axis = 0; shape_ == Shape::rectilinear && axis < 3; ++axis) {
    if (coordinates_[axis].components != 1 ||
        coordinates_[axis].count() != static_cast<uint64_t>(dimensions_[axis])) {
      return in_.malformed("there are not as many coordinates as DIMENSIONS say");
    }
  }
  if (shape_ != Shape::structured) MAILLE_CHECK(make_grid_points());
  const auto nx = static_cast<uint64_t>(dimensions_[0]), ny = static_cast<uint64_t>(dimensions_[1]),
             nz = static_cast<uint64_t>(dimensions_[2]);
  if (nx > max_points || nx * ny > max_points || nx * ny * nz != mesh_.point_count()) {
    return in_.malformed("there are " + std::to_string(mesh_.point_count()) +
                         " points, not as many as DIMENSIONS say");
  }
  // Steps along the axes that have cells; the cells are then the same in every number of dimensions, as nodes
  // 0 and 1 of a hexahedron are a line and its first four a quad.
  std::vector<std::pair<uint64_t, uint64_t>> axes;
  const uint64_t strides[] = {1, nx, nx * ny};
  for (size_t axis = 0; axis < 3; ++axis) {
    if (dimensions_[axis] > 1) axes.emplace_back(static_cast<uint64_t>(dimensions_[axis]) - 1, strides[axis]);
  }
  const size_t thick = axes.size();
  axes.resize(3, {1, 0});
  static constexpr CellType types[] = {CellType::vertex, CellType::line, CellType::quad,
                                       CellType::hexahedron};
  const size_t nodes = size_t{1} << thick;
  const uint64_t cells = axes[0].first * axes[1].first * axes[2].first;
  MAILLE_CHECK(budget_.take(cells, nodes * sizeof(uint32_t) + 1));
  const uint64_t a = axes[0].second, b = axes[1].second, c = axes[2].second;
  const uint64_t steps[8] = {0, a, a + b, b, c, a + c, a + b + c, b + c};
  for (uint64_t k = 0; k < axes[2].first; ++k) {
    for (uint64_t j = 0; j < axes[1].first; ++j) {
      for (uint64_t i = 0; i < axes[0].first; ++i) {
        const uint64_t first = i * a + j * b + k * c;
        for (size_t n = 0; n < nodes; ++n) store_.nodes.push_back(static_cast<uint32_t>(first + steps[n]));
      }
    }
  }
  store_.end_cells(cells, types[thick], nodes);
  return {};
}

Result<> VtkLegacyReader::finish_cells() {
  if (mesh_.point_count() > max_points) return in_.malformed("there are 2^32 points or more");
  if (shape_ == Shape::unstructured) return finish_unstructured();
  if (shape_ != Shape::poly_data) return finish_grid();
  MAILLE_CHECK(add_poly_data(verts_, CellType::vertex, CellType::poly_vertex));
  MAILLE_CHECK(add_poly_data(lines_, CellType::line, CellType::poly_line));
  MAILLE_CHECK(add_poly_data(polys_, CellType::triangle, CellType::polygon));
  return add_poly_data(strips_, CellType::triangle_strip, CellType::triangle_strip);
}

}  // namespace maille
