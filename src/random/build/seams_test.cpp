#include "random/build/seams.h"

#include <gtest/gtest.h>
#include <maille/random_access.h>

#include <cmath>
#include <map>

#include "random/mesh_geometry.h"
#include "support/random_file.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

constexpr uint32_t side = 60;

/// Two islands of a grid: texture coordinates jump by 100 in the middle, and so does a label of faces.
Mesh islands() {
  Mesh mesh = to_mesh(triangulated(shapes::grid(side, side)));
  for (uint64_t i = 0; i < mesh.point_count(); ++i) {
    float* p = &mesh.points.values<float>()[3 * i];
    p[2] = std::sin(0.3f * p[0]) * std::cos(0.2f * p[1]);
  }
  Array label = make_array("label", Domain::cell, Scalar::u8, 1, Role::label);
  Array texture = make_array("uv", Domain::corner, Scalar::f32, 2);
  label.resize(mesh.cell_count());
  texture.resize(mesh.corner_count());
  const auto positions = mesh.points.values<float>();
  const CellBlock& block = mesh.blocks[0];
  size_t corner = 0;
  for (uint64_t i = 0; i < block.size(); ++i) {
    double x = 0;
    for (const uint32_t p : block.cell(i)) x += static_cast<double>(positions[size_t{3} * p]);
    const bool right = x > 1.5 * side;
    label.values<uint8_t>()[i] = right;
    for (const uint32_t p : block.cell(i)) {
      texture.values<float>()[2 * corner] = positions[size_t{3} * p] + (right ? 100.0f : 0.0f);
      texture.values<float>()[2 * corner + 1] = positions[size_t{3} * p + 1];
      ++corner;
    }
  }
  mesh.arrays = {label, texture};
  return mesh;
}

/// The corners of `mesh` as points of their own, so that points stand twice along seams as in glTF.
Mesh with_points_at_seams(const Mesh& mesh) {
  Mesh split;
  Array texture = make_array("uv", Domain::point, Scalar::f32, 2);
  const auto of_corner = mesh.find("uv", Domain::corner)->values<float>();
  std::map<std::array<float, 3>, uint32_t> known;
  CellBlock block = mesh.blocks[0];
  for (size_t i = 0; i < block.connectivity.size(); ++i) {
    const uint32_t point = block.connectivity[i];
    const std::array<float, 3> key{static_cast<float>(point), of_corner[2 * i], of_corner[2 * i + 1]};
    const auto [at, is_new] = known.emplace(key, static_cast<uint32_t>(known.size()));
    block.connectivity[i] = at->second;
    if (!is_new) continue;
    const auto from = mesh.points.values<float>().subspan(size_t{3} * point, 3);
    split.points.resize(known.size());
    std::copy(from.begin(), from.end(), split.points.values<float>().end() - 3);
    texture.resize(known.size());
    std::copy_n(&of_corner[2 * i], 2, texture.values<float>().end() - 2);
  }
  split.blocks.push_back(std::move(block));
  split.arrays = {texture, *mesh.find("label", Domain::cell)};
  return split;
}

/// Are values at each level those that the mesh has there, and does no triangle span the seam?
void expect_values_at_all_levels(const Mesh& mesh, Domain of_texture) {
  const RandomFile file = random_file(mesh, {}, 128);
  ASSERT_EQ(file.error, "");
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  ASSERT_GE(open.levels(), 3u);
  EXPECT_LE(open.faces(2), mesh.cell_count() / 12);
  for (uint32_t level = 0; level < open.levels(); ++level) {
    Detail detail;
    detail.level = level;
    const Mesh coarse = open.extract(open.select({}, detail).value()).value();
    ASSERT_TRUE(validate(coarse));
    const Array* texture = coarse.find("uv", of_texture);
    const Array* label = coarse.find("label", Domain::cell);
    ASSERT_NE(texture, nullptr);
    ASSERT_NE(label, nullptr);
    size_t corner = 0;
    uint64_t wrong = 0;
    for (uint64_t i = 0; i < coarse.blocks[0].size(); ++i) {
      for (const uint32_t p : coarse.blocks[0].cell(i)) {
        const size_t tuple = of_texture == Domain::point ? p : corner;
        const float shift = label->values<uint8_t>()[i] == 1 ? 100.0f : 0.0f;
        const auto position = coarse.points.values<float>().subspan(size_t{3} * p, 3);
        const auto uv = texture->values<float>().subspan(2 * tuple, 2);
        wrong += uv[0] != position[0] + shift || uv[1] != position[1];
        ++corner;
      }
    }
    EXPECT_EQ(wrong, 0u) << "level " << level;
  }
}

TEST(Seams, OfCornersAreKeptAtAllLevels) {
  expect_values_at_all_levels(islands(), Domain::corner);
}

TEST(Seams, OfPointsThatStandTwiceAreKeptAtAllLevels) {
  expect_values_at_all_levels(with_points_at_seams(islands()), Domain::point);
}

TEST(Seams, AreNoneWhereEveryFaceDiffers) {
  Mesh mesh = to_mesh(triangulated(shapes::grid(side, side)));
  Array number = make_array("number", Domain::cell, Scalar::u32, 1);
  number.resize(mesh.cell_count());
  for (uint32_t i = 0; i < mesh.cell_count(); ++i) number.values<uint32_t>()[i] = i;
  mesh.arrays = {number};
  const RandomFile file = random_file(mesh, {}, 128);
  ASSERT_EQ(file.error, "");
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  EXPECT_LE(open.faces(open.levels() - 1), 128u);
  Detail coarsest;
  coarsest.level = open.levels() - 1;
  const Mesh coarse = open.extract(open.select({}, coarsest).value()).value();
  ASSERT_NE(coarse.find("number", Domain::cell), nullptr);
  for (const uint32_t face : coarse.find("number", Domain::cell)->values<uint32_t>())
    EXPECT_LT(face, mesh.cell_count());
}

TEST(Seams, ThatHoldTooMuchAreGivenUp) {
  Mesh mesh = to_mesh(triangulated(shapes::grid(side, side)));
  Array label = make_array("label", Domain::cell, Scalar::u8, 1);
  label.resize(mesh.cell_count());
  for (uint64_t i = 0; i < mesh.cell_count(); ++i) {
    const float* p = &mesh.points.values<float>()[size_t{3} * mesh.blocks[0].cell(i)[0]];
    const auto patch = static_cast<unsigned>(p[0] / 5) + static_cast<unsigned>(p[1] / 5);
    label.values<uint8_t>()[i] = patch % 2 == 0;
  }
  mesh.arrays = {label};
  const RandomFile file = random_file(mesh, {}, 128);
  ASSERT_EQ(file.error, "");
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  EXPECT_LE(open.faces(open.levels() - 1), 128u);
  EXPECT_LE(open.levels(), 5u);
}

TEST(Seams, AreNoneWithoutValues) {
  const Mesh mesh = to_mesh(triangulated(shapes::grid(4, 4)));
  const FaceLists faces{mesh.blocks[0].connectivity, {}};
  std::vector<Place> places;
  for (uint64_t i = 0; i < mesh.point_count(); ++i) places.push_back({i, 0, 0});
  EXPECT_TRUE(find_seams(mesh, faces, places).values.empty());
}

}  // namespace
}  // namespace maille::testing
