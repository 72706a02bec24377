#include <maille/slice.h>

#include <cmath>

#include "mesh/cell_faces.h"
#include "numbers/point_position.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

/// n x n x n cubes of side 1 with a linear field on points and the cell's number on cells; `split`: each cube
/// as six tetrahedra.
Mesh cubes(unsigned n, bool split) {
  Mesh mesh = grid(n, n, n);
  const auto at = mesh.points.values<float>();
  Array field = make_array("f", Domain::point, Scalar::f64, 2),
        number = make_array("n", Domain::cell, Scalar::i32, 1);
  field.resize(mesh.point_count());
  for (uint32_t i = 0; i < mesh.point_count(); ++i) {
    at[3 * i] = static_cast<float>(i % (n + 1));
    at[3 * i + 1] = static_cast<float>(i / (n + 1) % (n + 1));
    at[3 * i + 2] = static_cast<float>(i / (n + 1) / (n + 1));
    const double x = at[3 * i], y = at[3 * i + 1], z = at[3 * i + 2];
    field.values<double>()[2 * i] = 2 * x - y + 3 * z + 1;
    field.values<double>()[2 * i + 1] = x;
  }
  if (split) {
    constexpr unsigned tetrahedra[6][4] = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6},
                                           {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
    CellBlock block;
    block.type = CellType::tetrahedron;
    for (uint64_t i = 0; i < mesh.blocks[0].size(); ++i) {
      for (const auto& tetrahedron : tetrahedra) {
        for (const unsigned corner : tetrahedron)
          block.connectivity.push_back(mesh.blocks[0].cell(i)[corner]);
      }
    }
    mesh.blocks[0] = block;
  }
  number.resize(mesh.cell_count());
  for (uint32_t i = 0; i < mesh.cell_count(); ++i) number.values<int32_t>()[i] = static_cast<int32_t>(i);
  mesh.arrays = {field, number};
  return mesh;
}

double area_of(const Mesh& mesh) {
  double area = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto corners = block.cell(i);
      Vector3 sum;
      for (size_t k = 2; k < corners.size(); ++k) {
        const auto at = [&](size_t c) { return point_position(mesh.points, corners[c]); };
        sum = sum + cross(at(k - 1) - at(0), at(k) - at(0));
      }
      area += std::sqrt(dot(sum, sum)) / 2;
    }
  }
  return area;
}

TEST(Slice, PolygonsFillThePlaneAndHaveTheValuesThere) {
  const Vector3 normal = {{2.0 / 7, 3.0 / 7, 6.0 / 7}};
  for (const bool split : {false, true}) {
    const Mesh mesh = cubes(4, split);
    const Mesh cut = slice(mesh, {normal, -dot(normal, {{2.1, 1.9, 2.05}})});
    ASSERT_TRUE(validate(cut));
    ASSERT_EQ(cut.arrays.size(), 2u);
    for (uint32_t i = 0; i < cut.point_count(); ++i) {
      const Vector3 at = point_position(cut.points, i);
      EXPECT_NEAR(dot(normal, at) - dot(normal, {{2.1, 1.9, 2.05}}), 0, 1e-12);
      EXPECT_NEAR(cut.arrays[0].values<double>()[2 * i], 2 * at[0] - at[1] + 3 * at[2] + 1, 1e-12);
    }
    // The plane passes all four upright sides of a cube of 4: 16 seen from above.
    EXPECT_NEAR(area_of(cut), 16 / (6.0 / 7), 1e-9);
    for (uint64_t i = 0; i < cut.cell_count(); ++i)
      EXPECT_LT(cut.arrays[1].values<int32_t>()[i], static_cast<int32_t>(mesh.cell_count()));
  }
}

TEST(Slice, PolyhedraThatLookInwardsAreCutAsWell) {
  Mesh mesh = cubes(1, false);
  CellBlock block;
  block.type = CellType::polyhedron;
  block.offsets = {0, 24};
  block.cell_faces = {0, 6};
  block.face_sizes.assign(6, 4);
  unsigned f = 0;
  for_each_face(mesh.blocks[0], 0, [&](std::span<const uint32_t> corners) {
    std::vector<uint32_t> turned(corners.begin(), corners.end());
    if (f++ % 2 == 0) std::reverse(turned.begin(), turned.end());
    block.connectivity.insert(block.connectivity.end(), turned.begin(), turned.end());
  });
  mesh.blocks[0] = block;
  ASSERT_TRUE(validate(mesh));
  const Mesh cut = slice(mesh, {{{0, 0, 1}}, -0.25});
  ASSERT_EQ(cut.cell_count(), 1u);
  EXPECT_NEAR(area_of(cut), 1, 1e-12);
}

TEST(Slice, APlaneBesideTheMeshGivesNothing) {
  EXPECT_EQ(slice(cubes(2, true), {{{1, 0, 0}}, 5}).cell_count(), 0u);
  EXPECT_EQ(slice(Mesh(), {{{1, 0, 0}}, 0}).cell_count(), 0u);
}

TEST(Probe, LinearFieldsAreExactInAllCells) {
  for (const bool split : {false, true}) {
    const Mesh mesh = cubes(3, split);
    const std::vector<Vector3> places = {{{0.3, 1.7, 2.9}}, {{1, 1, 1}}, {{2.5, 0.01, 0.5}}, {{3.5, 1, 1}}};
    const auto found = probe(mesh, places);
    ASSERT_EQ(found.size(), 4u);
    for (size_t i = 0; i < 3; ++i) {
      ASSERT_TRUE(found[i].inside) << i;
      const double wanted = 2 * places[i][0] - places[i][1] + 3 * places[i][2] + 1;
      EXPECT_NEAR(found[i].values[0].components[0], wanted, 1e-9);
      EXPECT_EQ(found[i].values[1].components[0], static_cast<double>(found[i].cell));
    }
    EXPECT_FALSE(found[3].inside);
  }
}

}  // namespace
}  // namespace maille
