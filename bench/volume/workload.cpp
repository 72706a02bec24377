#include "workload.h"

#include <maille/generate.h>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace maille::bench {
namespace {

constexpr uint32_t around = 40, radial = 20, along = 209;
constexpr double inner = 0.4, outer = 1, length = 20, bend = 3;

Position shifted(double x, double y, double part) {
  return {x + bend * std::sin(2 * std::numbers::pi * part) / 2, y, length * part};
}

/// The edge along the pipe from corner `v` to corner `v + 8`.
BlockCurve lengthwise(uint32_t v, double x, double y) {
  BlockCurve curve{CurveKind::spline, v, v + 8, {}};
  for (int i = 1; i < 16; ++i) curve.points.push_back(shifted(x, y, i / 16.0));
  return curve;
}

bool is_solid(CellType type) {
  switch (type) {
    case CellType::tetrahedron:
    case CellType::voxel:
    case CellType::hexahedron:
    case CellType::wedge:
    case CellType::pyramid:
    case CellType::pentagonal_prism:
    case CellType::hexagonal_prism:
    case CellType::quadratic_tetrahedron:
    case CellType::quadratic_hexahedron:
    case CellType::quadratic_wedge:
    case CellType::quadratic_pyramid:
    case CellType::triquadratic_hexahedron:
    case CellType::quadratic_linear_wedge:
    case CellType::biquadratic_quadratic_wedge:
    case CellType::biquadratic_quadratic_hexahedron:
    case CellType::triquadratic_pyramid:
    case CellType::polyhedron:
    case CellType::lagrange_tetrahedron:
    case CellType::lagrange_hexahedron:
    case CellType::lagrange_wedge:
    case CellType::lagrange_pyramid:
      return true;
    default:
      return false;
  }
}

/// Without it cross-sections would be copies of one another, and coordinates repeat.
void twist(Array& points) {
  const auto values = points.values<double>();
  for (size_t i = 0; i + 2 < values.size(); i += 3) {
    const double x = values[i], y = values[i + 1], z = values[i + 2];
    const double turn = 0.3 + 0.04 * z, tilt = 0.5 + 0.01 * z;
    const double u = x * std::cos(turn) - y * std::sin(turn), v = x * std::sin(turn) + y * std::cos(turn);
    values[i] = u;
    values[i + 1] = v * std::cos(tilt) - z * std::sin(tilt);
    values[i + 2] = v * std::sin(tilt) + z * std::cos(tilt);
  }
}

void make_f32(Array& array) {
  if (array.type != Scalar::f64) return;
  Array narrow = array;
  narrow.type = Scalar::f32;
  narrow.resize(array.count());
  std::transform(array.values<double>().begin(), array.values<double>().end(), narrow.values<float>().begin(),
                 [](double value) { return static_cast<float>(value); });
  array = std::move(narrow);
}

}  // namespace

Result<Mesh> generate_pipe() {
  BlockDescription pipe;
  const Grading even = {{}}, to_the_wall = {{1, 1, 0.15}};
  constexpr double x[4] = {1, -1, -1, 1}, y[4] = {1, 1, -1, -1};
  for (const double part : {0.0, 1.0}) {
    for (int i = 0; i < 4; ++i) pipe.vertices.push_back(shifted(inner * x[i], inner * y[i], part));
    const double corner = outer * std::numbers::sqrt2 / 2;
    for (int i = 0; i < 4; ++i) pipe.vertices.push_back(shifted(corner * x[i], corner * y[i], part));
  }
  for (uint32_t i = 0; i < 8; ++i)
    pipe.curves.push_back(lengthwise(i, pipe.vertices[i][0], pipe.vertices[i][1]));
  constexpr double middle_x[4] = {0, -1, 0, 1}, middle_y[4] = {1, 0, -1, 0};
  const auto add_block = [&](std::array<uint32_t, 4> base, uint32_t nx, uint32_t ny, const Grading& graded) {
    HexBlock block;
    for (uint32_t i = 0; i < 4; ++i) {
      block.corners[i] = base[i];
      block.corners[i + 4] = base[i] + 8;
    }
    block.divisions = {nx, ny, along};
    block.gradings.fill(even);
    for (size_t edge = 0; edge < 4; ++edge) block.gradings[edge] = graded;
    pipe.blocks.push_back(block);
  };
  add_block({0, 1, 2, 3}, around, around, even);
  for (uint32_t i = 0; i < 4; ++i) {
    const uint32_t next = (i + 1) % 4;
    for (uint32_t end = 0; end < 16; end += 8) {
      const Position arc = shifted(outer * middle_x[i], outer * middle_y[i], end / 8);
      pipe.curves.push_back({CurveKind::arc, 4 + i + end, 4 + next + end, {arc}});
    }
    add_block({i, 4 + i, 4 + next, next}, radial, around, to_the_wall);
  }
  auto mesh = generate_mesh(pipe, {});
  if (!mesh) return mesh;
  std::erase_if(mesh->blocks, [](const CellBlock& block) { return block.type != CellType::hexahedron; });
  mesh->arrays.clear();
  twist(mesh->points);
  return as_f32(std::move(*mesh));
}

Mesh as_f32(Mesh mesh) {
  make_f32(mesh.points);
  for (Array& array : mesh.arrays) make_f32(array);
  return mesh;
}

uint64_t solid_cells(const Mesh& mesh) {
  uint64_t count = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) count += is_solid(block.type_of(i)) ? 1 : 0;
  }
  return count == 0 ? mesh.cell_count() : count;
}

}  // namespace maille::bench
