#include <gmock/gmock.h>
#include <maille/triangles.h>

namespace maille {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<uint32_t> triangles_of(CellType type, std::vector<uint32_t> nodes) {
  Mesh mesh;
  mesh.points.resize(nodes.size());
  CellBlock block;
  block.type = type;
  if (nodes_of(type) == 0) block.offsets = std::vector<uint64_t>{0, nodes.size()};
  block.connectivity.assign(nodes.begin(), nodes.end());
  mesh.blocks.push_back(std::move(block));
  return triangle_indices(mesh);
}

TEST(Triangles, PolygonsAreFans) {
  EXPECT_THAT(triangles_of(CellType::triangle, {2, 1, 0}), ElementsAre(2, 1, 0));
  EXPECT_THAT(triangles_of(CellType::quad, {0, 1, 2, 3}), ElementsAre(0, 1, 2, 0, 2, 3));
  EXPECT_THAT(triangles_of(CellType::polygon, {0, 1, 2, 3, 4}), ElementsAre(0, 1, 2, 0, 2, 3, 0, 3, 4));
}

TEST(Triangles, StripsAndPixelsKeepTheirSide) {
  EXPECT_THAT(triangles_of(CellType::triangle_strip, {0, 1, 2, 3}), ElementsAre(0, 1, 2, 2, 1, 3));
  EXPECT_THAT(triangles_of(CellType::pixel, {0, 1, 2, 3}), ElementsAre(0, 1, 3, 0, 3, 2));
}

TEST(Triangles, QuadraticFacesHaveTheirCorners) {
  EXPECT_THAT(triangles_of(CellType::quadratic_triangle, {0, 1, 2, 3, 4, 5}), ElementsAre(0, 1, 2));
  EXPECT_THAT(triangles_of(CellType::biquadratic_quad, {0, 1, 2, 3, 4, 5, 6, 7, 8}),
              ElementsAre(0, 1, 2, 0, 2, 3));
}

TEST(Triangles, SolidsLinesAndDegeneratePolygonsHaveNone) {
  EXPECT_THAT(triangles_of(CellType::tetrahedron, {0, 1, 2, 3}), IsEmpty());
  EXPECT_THAT(triangles_of(CellType::line, {0, 1}), IsEmpty());
  EXPECT_THAT(triangles_of(CellType::polygon, {0, 1}), IsEmpty());
}

TEST(Triangles, PositionsBecomeFloats) {
  Mesh mesh;
  mesh.points = make_array("position", Domain::point, Scalar::f64, 3);
  mesh.points.resize(1);
  mesh.points.values<double>()[1] = 0.1;
  EXPECT_THAT(positions_as_floats(mesh), ElementsAre(0, 0.1f, 0));
}

}  // namespace
}  // namespace maille
