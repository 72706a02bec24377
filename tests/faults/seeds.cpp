#include "faults/seeds.h"

#include <maille/file.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "support/codec.h"
#include "support/data.h"
#include "support/files.h"
#include "support/random_file.h"
#include "support/random_mesh.h"
#include "support/random_volume.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

void add_seed(std::vector<Seed>& seeds, const std::string& name, std::vector<std::byte> bytes) {
  Seed seed{name, std::move(bytes), Mode::single, {}};
  const auto source = memory_source(Bytes(seed.bytes), name);
  const auto mode = mode_of(*source);
  auto mesh = decode(*source);
  if (!mode || !mesh) return;
  seed.mode = *mode;
  seed.mesh = *std::move(mesh);
  seeds.push_back(std::move(seed));
}

void encode_seed(std::vector<Seed>& seeds, const std::string& name, const Mesh& mesh,
                 const EncodeOptions& options) {
  if (auto file = encode_bytes(mesh, options)) add_seed(seeds, name, std::move(file->bytes));
}

/// The normal of a triangle.
std::array<float, 3> facet_normal(std::span<const float> positions, const uint32_t* corners) {
  const auto side = [&](unsigned corner, unsigned k) {
    return static_cast<double>(positions[size_t{corners[corner]} * 3 + k]) -
           static_cast<double>(positions[size_t{corners[0]} * 3 + k]);
  };
  std::array<double, 3> normal;
  for (unsigned k = 0; k < 3; ++k) {
    const unsigned a = (k + 1) % 3, b = (k + 2) % 3;
    normal[k] = side(1, a) * side(2, b) - side(1, b) * side(2, a);
  }
  const double length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
  std::array<float, 3> unit;
  for (unsigned k = 0; k < 3; ++k) unit[k] = static_cast<float>(normal[k] / length);
  return unit;
}

/// What scans and models are like, and random meshes hardly ever: nothing but triangles, a smooth shape,
/// normals of its faces, and a field.
Mesh smooth_mesh() {
  Mesh mesh = to_mesh(triangulated(shapes::torus(14, 8)));
  const auto positions = mesh.points.values<float>();
  Array normals = make_array("normal", Domain::cell, Scalar::f32, 3, Role::normal),
        field = make_array("field", Domain::point, Scalar::f32, 2);
  normals.resize(mesh.cell_count());
  field.resize(mesh.point_count());
  for (size_t i = 0; i < mesh.cell_count(); ++i) {
    const auto normal = facet_normal(positions, mesh.blocks[0].connectivity.data() + 3 * i);
    std::copy(normal.begin(), normal.end(), normals.values<float>().begin() + static_cast<ptrdiff_t>(3 * i));
  }
  for (size_t i = 0; i < mesh.point_count(); ++i) {
    field.values<float>()[2 * i] = positions[3 * i] * positions[3 * i + 1] + 3;
    field.values<float>()[2 * i + 1] = positions[3 * i + 2];
  }
  mesh.arrays = {std::move(normals), std::move(field)};
  return mesh;
}

/// Bounds of one kind on everything but labels.
void bound_all(const Mesh& mesh, const Tolerance& tolerance, EncodeOptions& options) {
  if (tolerance.kind != Tolerance::Kind::pointwise) options.positions = tolerance;
  for (const Array& array : mesh.arrays) {
    if (array.role != Role::label) options.arrays[array.name] = tolerance;
  }
}

/// Every kind of bound, in files cut into parts, pieces or charts and in whole ones, at all levels.
void add_bounded_seeds(std::vector<Seed>& seeds) {
  using Kind = Tolerance::Kind;
  static constexpr Tolerance tolerances[] = {{},
                                             {Kind::absolute, 0.01},
                                             {Kind::relative, 1e-3},
                                             {Kind::bits, 11},
                                             {Kind::norm, 0.02},
                                             {Kind::psnr, 60},
                                             {Kind::pointwise, 0.01}};
  static constexpr int efforts[] = {9, 2, 5, 1, 7};
  RandomVolumeOptions volume;
  volume.corner_arrays = volume.special_values = false;
  RandomMeshOptions surface;
  surface.special_values = false;
  for (uint64_t number = 0; number < 42; ++number) {
    EncodeOptions options;
    options.mode = static_cast<Mode>(number % 3);
    options.effort = efforts[number % std::size(efforts)];
    if (number / 3 % 2 == 0) options.most_cells_per_part = options.mode == Mode::single ? 60 : 8;
    if (number % 4 == 3) options.order = Order::keep;
    const Mesh mesh = number / 6 % 2 == 0            ? smooth_mesh()
                      : options.mode == Mode::stream ? random_volume(number, volume)
                                                     : random_surface(number, surface);
    bound_all(mesh, tolerances[number % std::size(tolerances)], options);
    encode_seed(seeds, "bounded mesh " + std::to_string(number), mesh, options);
  }
}

/// Parts and charts that have some blocks of their mesh each.
void add_seeds_in_blocks(std::vector<Seed>& seeds) {
  RandomMeshOptions surface;
  surface.faces = 60;
  for (uint64_t number = 100; number < 104; ++number) {
    const Mesh mesh = random_surface(number, surface);
    EncodeOptions options;
    options.effort = static_cast<int>(2 + number % 4);
    add_seed(seeds, "charts " + std::to_string(number), random_file(mesh, options).bytes);
    options.most_cells_per_part = 12;
    encode_seed(seeds, "parts " + std::to_string(number), mesh, options);
  }
}

}  // namespace

std::vector<Seed> maille_seeds() {
  std::vector<Seed> seeds;
  for (const char* folder : {"single", "stream", "random"}) {
    const std::filesystem::path place = std::filesystem::path(tests_folder()) / "golden" / folder;
    std::vector<std::filesystem::path> paths;
    for (const auto& entry : std::filesystem::directory_iterator(place)) paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    for (const auto& path : paths) add_seed(seeds, path.filename().string(), read_bytes(path));
  }
  for (uint64_t number = 0; number < 30; ++number) {
    EncodeOptions options;
    options.mode = static_cast<Mode>(number % 3);
    options.effort = static_cast<int>(1 + number % 9);
    if (number % 4 == 1) options.order = Order::keep;
    if (number % 5 == 2) options.positions = {Tolerance::Kind::bits, 9};
    RandomVolumeOptions volume;
    volume.corner_arrays = false;
    RandomMeshOptions surface;
    surface.faces = 40;
    const Mesh mesh =
        options.mode == Mode::stream ? random_volume(number, volume) : random_surface(number, surface);
    encode_seed(seeds, "mesh " + std::to_string(number), mesh, options);
  }
  add_bounded_seeds(seeds);
  add_seeds_in_blocks(seeds);
  return seeds;
}

}  // namespace maille::testing
