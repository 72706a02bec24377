#include "workload.h"

#include <maille/io.h>
#include <algorithm>
#include <cmath>
#include <limits>

namespace maille::bench {
namespace {

template <class T>
void append_floats(const Array& points, std::vector<float>& out) {
  for (const T value : points.values<T>()) out.push_back(static_cast<float>(value));
}

Result<std::vector<float>> positions_of(const Mesh& mesh) {
  std::vector<float> xyz;
  xyz.reserve(3 * mesh.point_count());
  switch (mesh.points.type) {
    case Scalar::f32:
      append_floats<float>(mesh.points, xyz);
      break;
    case Scalar::f64:
      append_floats<double>(mesh.points, xyz);
      break;
    case Scalar::i32:
      append_floats<int32_t>(mesh.points, xyz);
      break;
    case Scalar::i16:
      append_floats<int16_t>(mesh.points, xyz);
      break;
    case Scalar::u16:
      append_floats<uint16_t>(mesh.points, xyz);
      break;
    default:
      return failure(ErrorCode::unsupported, "positions of this type are not benchmarked");
  }
  return xyz;
}

std::vector<uint32_t> fans(const Surface& surface) {
  if (surface.degrees.empty()) return surface.corners;
  std::vector<uint32_t> triangles;
  size_t first = 0;
  for (const uint32_t degree : surface.degrees) {
    for (uint32_t i = 2; i < degree; ++i) {
      for (const size_t corner : {first, first + i - 1, first + i})
        triangles.push_back(surface.corners[corner]);
    }
    first += degree;
  }
  return triangles;
}

void round_to_lattice(std::vector<float>& xyz, int bits) {
  double low[3], longest = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (size_t i = axis; i < xyz.size(); i += 3) {
      if (!std::isfinite(xyz[i])) continue;
      least = std::min<double>(least, xyz[i]);
      most = std::max<double>(most, xyz[i]);
    }
    low[axis] = least;
    longest = std::max(longest, most - least);
  }
  const double step = longest / ((1 << bits) - 1);
  for (size_t i = 0; i < xyz.size(); ++i) {
    const double steps = step > 0 ? (xyz[i] - low[i % 3]) / step : 0;
    xyz[i] = std::isfinite(steps) ? static_cast<float>(std::nearbyint(steps)) : 0;
  }
}

Mesh mesh_of(const Surface& surface, bool lattice) {
  Mesh mesh;
  mesh.points = make_array("position", Domain::point, lattice ? Scalar::i32 : Scalar::f32, 3);
  mesh.points.resize(surface.vertices());
  if (lattice) {
    std::transform(surface.xyz.begin(), surface.xyz.end(), mesh.points.values<int32_t>().begin(),
                   [](float value) { return static_cast<int32_t>(value); });
  } else {
    std::copy(surface.xyz.begin(), surface.xyz.end(), mesh.points.values<float>().begin());
  }
  CellBlock block;
  block.type = surface.degrees.empty() ? CellType::triangle : CellType::polygon;
  if (block.type == CellType::polygon) {
    block.offsets.push_back(0);
    for (const uint32_t degree : surface.degrees) block.offsets.push_back(block.offsets.back() + degree);
  }
  block.connectivity = surface.corners;
  mesh.blocks.push_back(std::move(block));
  return mesh;
}

}  // namespace

Result<Surface> surface_of(const Mesh& mesh) {
  auto xyz = positions_of(mesh);
  if (!xyz) return tl::unexpected(xyz.error());

  Surface surface;
  surface.xyz = std::move(*xyz);
  bool only_triangles = true;
  for (const CellBlock& block : mesh.blocks) {
    if (!is_face(block.type)) continue;
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto face = block.cell(i);
      surface.degrees.push_back(static_cast<uint32_t>(face.size()));
      surface.corners.insert(surface.corners.end(), face.begin(), face.end());
      only_triangles = only_triangles && face.size() == 3;
    }
  }
  if (surface.corners.empty()) return failure(ErrorCode::unsupported, "has no faces");
  if (only_triangles) surface.degrees.clear();
  return surface;
}

Result<Surface> load(const std::string& path) {
  const auto read = read_mesh(path);
  if (!read) return tl::unexpected(read.error());
  return surface_of(read->mesh);
}

Surface flip_every_second(Surface surface) {
  size_t first = 0;
  for (size_t face = 0; face < surface.faces(); ++face) {
    const size_t degree = surface.degrees.empty() ? 3 : surface.degrees[face];
    const auto begin = surface.corners.begin() + static_cast<std::ptrdiff_t>(first);
    if (face % 2 == 1) std::reverse(begin, begin + static_cast<std::ptrdiff_t>(degree));
    first += degree;
  }
  return surface;
}

Workload make_workload(const Surface& surface, int bits) {
  Workload workload;
  workload.bits = bits;
  workload.surface = surface;
  if (bits > 0) round_to_lattice(workload.surface.xyz, bits);
  workload.triangles = fans(workload.surface);
  workload.mesh_for_maille = mesh_of(workload.surface, bits > 0);
  return workload;
}

}  // namespace maille::bench
