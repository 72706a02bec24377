// The files were written by CGNS' own library (tests/formats/make_cgns.c), but polyhedra_33.cgns.
#include "io/cgns/cgns.h"

#include <gmock/gmock.h>
#include <maille/series.h>

#include <cmath>
#include <map>
#include <string>

#include "io/same_mesh.h"
#include "support/hdf5_files.h"
#include "support/sample_mesh.h"

namespace maille {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using testing::expect_same_mesh;
using ::testing::HasSubstr;
using ::testing::Pair;
using testing::sample_path;
using testing::text_of_file;

class Cgns : public testing::Hdf5Test {
 protected:
  static std::vector<std::string> names(const Mesh& mesh) {
    std::vector<std::string> names;
    for (const CellBlock& block : mesh.blocks) names.push_back(block.name);
    return names;
  }
};

TEST_F(Cgns, StructuredZonesAreHexahedraWithoutPlanesOfGhosts) {
  const ReadResult result = read("structured.cgns");
  const Mesh& mesh = result.mesh;
  EXPECT_THAT(names(mesh), ElementsAre("left", "right"));
  EXPECT_EQ(mesh.blocks[0].type, CellType::hexahedron);
  EXPECT_THAT(mesh.blocks[0].cell(0), ElementsAre(0, 1, 4, 3, 9, 10, 13, 12));
  EXPECT_THAT(mesh.blocks[1].cell(5), ElementsAre(24, 25, 29, 28, 36, 37, 41, 40));
  EXPECT_THAT(testing::values_of<double>(mesh, "Pressure", Domain::cell),
              ElementsAre(1011, 1012, 1021, 1022, 1111, 1112, 1113, 1121, 1122, 1123));
  EXPECT_THAT(result.notes, Contains(HasSubstr("the last of 2 time steps")));
  EXPECT_THAT(result.notes, Contains(HasSubstr("planes of ghosts")));
}

TEST_F(Cgns, AnArrayThatOneZoneHasIsNanInTheOthers) {
  const std::vector<float> values =
      testing::values_of<float>(read("structured.cgns").mesh, "Temperature", Domain::point);
  ASSERT_EQ(values.size(), 42u);
  EXPECT_TRUE(std::isnan(values[17]));
  EXPECT_EQ(values[18], 20);
  EXPECT_EQ(values[41], 43);
}

TEST_F(Cgns, BoundaryConditionsMarkPointsOfEveryZone) {
  const Mesh mesh = read("structured.cgns").mesh;
  const std::vector<uint8_t> inflow = testing::values_of<uint8_t>(mesh, "inflow", Domain::point);
  const auto positions = mesh.points.values<double>();
  for (size_t i = 0; i < inflow.size(); ++i) EXPECT_EQ(inflow[i], positions[3 * i] == 0 ? 1 : 0) << i;
  EXPECT_THAT(mesh.metadata, ElementsAre(Pair("cgns.boundary.left/inflow", "BCInflow"),
                                         Pair("cgns.boundary.right/inflow", "BCInflow")));
}

TEST_F(Cgns, StepsHaveTheirOwnSolutions) {
  const auto steps = read_series(sample_path("structured.cgns"));
  ASSERT_TRUE(steps) << steps.error().message;
  ASSERT_EQ(steps->size(), 2u);
  EXPECT_EQ((*steps)[1].time, 1.5);
  const auto first = read_series_entry((*steps)[0]);
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_EQ(testing::values_of<double>(first->mesh, "Pressure", Domain::cell)[9], 123);
  EXPECT_THAT(testing::values_of<double>(first->mesh, "TimeValue", Domain::mesh), ElementsAre(0.5));
  const auto none = read_series_entry({sample_path("structured.cgns"), 3, 2});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::usage);
}

/// Where VTK has the nodes of a cell, as in vtkTriQuadraticHexahedron and its kin, each as the corners in
/// whose middle it is.
const std::map<CellType, std::vector<std::vector<size_t>>>& middles() {
  static const std::vector<std::vector<size_t>> hexa = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                                        {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  static const std::vector<std::vector<size_t>> wedge = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5},
                                                         {5, 3}, {0, 3}, {1, 4}, {2, 5}};
  static const std::vector<std::vector<size_t>> pyramid = {{0, 1}, {1, 2}, {2, 3}, {3, 0},
                                                           {0, 4}, {1, 4}, {2, 4}, {3, 4}};
  const auto with = [](std::vector<std::vector<size_t>> nodes, std::vector<std::vector<size_t>> more) {
    nodes.insert(nodes.end(), more.begin(), more.end());
    return nodes;
  };
  static const std::map<CellType, std::vector<std::vector<size_t>>> table = {
      {CellType::quadratic_edge, {{0, 1}}},
      {CellType::quadratic_triangle, {{0, 1}, {1, 2}, {2, 0}}},
      {CellType::quadratic_quad, {{0, 1}, {1, 2}, {2, 3}, {3, 0}}},
      {CellType::biquadratic_quad, {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 1, 2, 3}}},
      {CellType::quadratic_tetrahedron, {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}},
      {CellType::quadratic_pyramid, pyramid},
      {CellType::lagrange_pyramid, with(pyramid, {{0, 1, 2, 3}})},
      {CellType::quadratic_wedge, wedge},
      {CellType::biquadratic_quadratic_wedge, with(wedge, {{0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}})},
      {CellType::quadratic_hexahedron, hexa},
      {CellType::triquadratic_hexahedron, with(hexa, {{0, 4, 7, 3},
                                                      {1, 2, 6, 5},
                                                      {0, 1, 5, 4},
                                                      {3, 7, 6, 2},
                                                      {0, 3, 2, 1},
                                                      {4, 5, 6, 7},
                                                      {0, 1, 2, 3, 4, 5, 6, 7}})}};
  return table;
}

TEST_F(Cgns, NodesOfEveryElementComeInTheOrderOfVtk) {
  const Mesh mesh = read("elements.cgns").mesh;
  EXPECT_EQ(mesh.cell_count(), 38u);
  const auto positions = mesh.points.values<float>();
  unsigned curved = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto found = middles().find(block.type_of(i));
      if (found == middles().end()) continue;
      const auto nodes = block.cell(i);
      const size_t corners = nodes.size() - found->second.size();
      for (size_t m = 0; m < found->second.size(); ++m) {
        for (size_t k = 0; k < 3; ++k) {
          float mean = 0;
          for (const size_t corner : found->second[m])
            mean += positions[3 * nodes[corner] + k] / static_cast<float>(found->second[m].size());
          EXPECT_EQ(positions[3 * nodes[corners + m] + k], mean) << name_of(block.type_of(i)) << m;
        }
      }
      ++curved;
    }
  }
  EXPECT_EQ(curved, 22u);
}

TEST_F(Cgns, SectionsAreBlocksInTheOrderOfElements) {
  const Mesh mesh = read("elements.cgns").mesh;
  EXPECT_EQ(mesh.blocks.front().name, "z BAR_3");
  EXPECT_EQ(mesh.blocks.back().name, "a mixed");
  // Values at cells are those of the solids, in the order of elements.
  const std::vector<int32_t> numbers = testing::values_of<int32_t>(mesh, "number", Domain::cell);
  int32_t expected = 0;
  for (uint64_t cell = 0; cell < 38; ++cell) {
    const CellType type = cell < 19 ? mesh.blocks[cell].type : mesh.blocks[19].type_of(cell - 19);
    EXPECT_EQ(numbers[cell], dimension_of(type) == 3 ? expected++ : 0) << cell;
  }
  EXPECT_EQ(expected, 22);
  const std::vector<uint8_t> wall = testing::values_of<uint8_t>(mesh, "wall", Domain::cell);
  for (size_t cell = 0; cell < wall.size(); ++cell) EXPECT_EQ(wall[cell], cell == 1 || cell == 21) << cell;
}

TEST_F(Cgns, PolyhedraHaveTheirFacesAndConditionsAreBlocks) {
  const Mesh mesh = read("polyhedra.cgns").mesh;
  EXPECT_THAT(names(mesh), ElementsAre("two", "inlet", "wall"));
  const CellBlock& block = mesh.blocks[0];
  ASSERT_EQ(block.type, CellType::polyhedron);
  EXPECT_THAT(block.cell(0).last(4), ElementsAre(1, 4, 10, 7));
  EXPECT_THAT(block.cell(1).first(4), ElementsAre(7, 10, 4, 1));  // the same, seen from the other side
  EXPECT_THAT(block.faces(1), ElementsAre(4, 4, 4, 4, 4, 4));
  EXPECT_EQ(mesh.blocks[2].size(), 5u);
}

TEST_F(Cgns, FacesOfPolyhedraThatOnlyTheirParentsNameAreCellsWithANote) {
  const ReadResult result = read("parents.cgns");
  EXPECT_EQ(result.mesh.cell_count(), 11u);
  EXPECT_THAT(result.notes,
              ElementsAre("polyhedra that are given by ParentElements alone are not read: their 11 faces are "
                          "the cells"));
  EXPECT_THAT(read("polyhedra.cgns").notes, ElementsAre());
}

TEST_F(Cgns, ListsOfOlderVersionsHaveTheirLengthBeforeThem) {
  Mesh mesh = read("polyhedra_33.cgns").mesh;
  EXPECT_EQ(testing::values_of<float>(mesh, "Density", Domain::cell)[1], 2);
  mesh.arrays.clear();
  Mesh other = read("polyhedra.cgns").mesh;
  mesh.metadata = other.metadata;
  expect_same_mesh(mesh, other);
}

TEST_F(Cgns, SurvivesRandomDamage) {
  testing::expect_to_survive_damage(text_of_file(sample_path("polyhedra_33.cgns")), "x.cgns", 200);
}

}  // namespace
}  // namespace maille
