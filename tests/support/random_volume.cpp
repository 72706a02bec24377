#include "support/random_volume.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <string>

#include "support/random.h"

namespace maille::testing {
namespace {

void fill(Array& array, uint64_t tuples, const RandomVolumeOptions& options, Random& random) {
  array.resize(tuples);
  const size_t size = size_of(array.type);
  for (size_t at = 0; at < array.bytes.size(); at += size) {
    if (options.special_values && random.chance(30)) {
      const uint64_t bits = random.next();
      std::memcpy(array.bytes.data() + at, &bits, size);
    } else if (array.type == Scalar::f32) {
      const float value = static_cast<float>(random.below(1000)) / 64 - 5;
      std::memcpy(array.bytes.data() + at, &value, size);
    } else if (array.type == Scalar::f64) {
      const double value = static_cast<double>(random.below(100000)) / 7 - 5;
      std::memcpy(array.bytes.data() + at, &value, size);
    } else {
      const uint64_t value = random.below(100);
      std::memcpy(array.bytes.data() + at, &value, size);
    }
  }
}

void add_cell(CellBlock& block, CellType type, uint32_t points, Random& random) {
  uint32_t nodes = nodes_of(type) != 0 ? nodes_of(type) : random.between(1, 7);
  if (type == CellType::polyhedron) {
    nodes = 0;
    for (uint32_t faces = random.between(1, 5); faces > 0; --faces) {
      block.face_sizes.push_back(random.between(3, 5));
      nodes += block.face_sizes.back();
    }
  }
  for (uint32_t i = 0; i < nodes; ++i) block.connectivity.push_back(random.below(points));
  if (block.type == CellType::mixed) block.types.push_back(static_cast<uint8_t>(type));
  if (!block.offsets.empty()) block.offsets.push_back(block.connectivity.size());
  block.cell_faces.push_back(block.face_sizes.size());
}

CellBlock random_block(uint32_t points, const RandomVolumeOptions& options, Random& random) {
  static const char* const names[] = {"", "inlet", "solid body", "größe", "wall"};
  const auto any_type = [&] { return options.types[random.below(options.types.size())]; };
  CellBlock block;
  if (options.names) block.name = names[random.below(std::size(names))];
  block.type = options.mixed && random.chance(30) ? CellType::mixed : any_type();
  if (nodes_of(block.type) == 0) block.offsets.push_back(0);
  block.cell_faces.push_back(0);
  for (uint32_t cells = random.between(1, 12); cells > 0; --cells) {
    add_cell(block, block.type == CellType::mixed ? any_type() : block.type, points, random);
  }
  if (block.face_sizes.empty()) block.cell_faces.clear();
  return block;
}

}  // namespace

std::vector<CellType> all_volume_types() {
  return {CellType::tetrahedron,
          CellType::hexahedron,
          CellType::wedge,
          CellType::pyramid,
          CellType::triangle,
          CellType::quad,
          CellType::line,
          CellType::vertex,
          CellType::polygon,
          CellType::poly_line,
          CellType::polyhedron,
          CellType::quadratic_tetrahedron,
          CellType::quadratic_hexahedron,
          CellType::quadratic_wedge,
          CellType::quadratic_pyramid,
          CellType::quadratic_triangle,
          CellType::biquadratic_quad,
          CellType::triquadratic_hexahedron,
          CellType::biquadratic_quadratic_wedge,
          CellType::voxel,
          CellType::lagrange_hexahedron,
          CellType::poly_vertex,
          CellType::convex_point_set};
}

Mesh random_volume(uint64_t seed, const RandomVolumeOptions& options) {
  Random random(seed);
  Mesh mesh;
  const uint32_t points = random.between(1, 40);
  mesh.points.type = options.position;
  fill(mesh.points, points, options, random);
  for (uint32_t blocks = options.several_blocks ? random.between(1, 4) : 1; blocks > 0; --blocks) {
    mesh.blocks.push_back(random_block(points, options, random));
  }
  if (!options.arrays) return mesh;
  static constexpr Domain domains[] = {Domain::point, Domain::cell, Domain::corner, Domain::mesh};
  for (const Domain domain : domains) {
    if (domain == Domain::corner && !options.corner_arrays) continue;
    for (uint32_t i = random.below(3); i > 0; --i) {
      // Compilers evaluate arguments in different orders.
      const uint32_t components = random.between(1, 4);
      const auto type = static_cast<Scalar>(random.below(scalar_count));
      Array array = make_array("a" + std::to_string(mesh.arrays.size()) + " b", domain, type, components);
      fill(array, domain == Domain::mesh ? random.below(5) : mesh.count_of(domain), options, random);
      mesh.arrays.push_back(std::move(array));
    }
  }
  return mesh;
}

}  // namespace maille::testing
