// The files were written by tests/formats/make_hdf5.py.
#include "io/vtk/vtkhdf.h"

#include <gmock/gmock.h>
#include <maille/series.h>

#include <algorithm>
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
using testing::sample_path;
using testing::text_of_file;

class VtkHdf : public testing::Hdf5Test {
 protected:
  /// Datasets come by name.
  static void sort_arrays(Mesh& mesh) {
    std::sort(mesh.arrays.begin(), mesh.arrays.end(), [](const Array& a, const Array& b) {
      return std::pair(a.domain, a.name) < std::pair(b.domain, b.name);
    });
  }
};

TEST_F(VtkHdf, PartsAreThoseOfAPvtu) {
  ReadResult ours = read("pieces.vtkhdf"), theirs = read("pieces.pvtu");
  sort_arrays(ours.mesh);
  sort_arrays(theirs.mesh);
  // The one has blocks where the type changes.
  ASSERT_EQ(theirs.mesh.blocks.size(), 1u);
  std::vector<uint32_t> corners;
  std::vector<uint8_t> types;
  for (const CellBlock& block : ours.mesh.blocks) {
    corners.insert(corners.end(), block.connectivity.begin(), block.connectivity.end());
    types.insert(types.end(), block.size(), static_cast<uint8_t>(block.type));
  }
  EXPECT_EQ(corners, theirs.mesh.blocks[0].connectivity);
  EXPECT_EQ(types, theirs.mesh.blocks[0].types);
  EXPECT_EQ(ours.notes, theirs.notes);
  ours.mesh.blocks = theirs.mesh.blocks;
  expect_same_mesh(ours.mesh, theirs.mesh);
}

TEST_F(VtkHdf, ReadsPackedPolyhedra) {
  const Mesh ours = read("polyhedra.vtkhdf").mesh, theirs = read("polyhedra.vtu").mesh;
  EXPECT_EQ(ours.points.bytes, theirs.points.bytes);
  ASSERT_EQ(ours.cell_count(), theirs.cell_count());
  const CellBlock& polyhedron = ours.blocks.back();
  EXPECT_EQ(polyhedron.type, CellType::polyhedron);
  ASSERT_EQ(theirs.blocks.size(), 1u);
  EXPECT_TRUE(std::ranges::equal(polyhedron.cell(0), theirs.blocks[0].cell(theirs.cell_count() - 1)));
  EXPECT_EQ(polyhedron.face_sizes, theirs.blocks[0].face_sizes);
}

TEST_F(VtkHdf, GhostCellsAreLeftOutAndPointsJoinedByTheirNumbers) {
  const ReadResult result = read("ghosts.vtkhdf");
  EXPECT_EQ(result.mesh.point_count(), 28u);
  EXPECT_THAT(testing::values_of<int32_t>(result.mesh, "owner", Domain::cell), ElementsAre(0, 0, 2, 2, 4, 4));
  EXPECT_EQ(result.mesh.find("vtkGhostType", Domain::cell), nullptr);
  EXPECT_THAT(result.notes, Contains(HasSubstr("4 ghost cells left out")));
}

TEST_F(VtkHdf, StepsShareAMeshAndHaveArraysOfTheirOwn) {
  const auto steps = read_series(sample_path("steps.hdf"));
  ASSERT_TRUE(steps) << steps.error().message;
  ASSERT_EQ(steps->size(), 3u);
  const double times[] = {0, 0.5, 2}, energies[] = {10, 20, 30};
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ((*steps)[i].time, times[i]);
    const auto step = read_series_entry((*steps)[i]);
    ASSERT_TRUE(step) << step.error().message;
    EXPECT_EQ(step->mesh.cell_count(), 4u);
    EXPECT_THAT(testing::values_of<double>(step->mesh, "TimeValue", Domain::mesh), ElementsAre(times[i]));
    EXPECT_THAT(testing::values_of<double>(step->mesh, "energy", Domain::mesh), ElementsAre(energies[i]));
    const std::vector<double> field = testing::values_of<double>(step->mesh, "T", Domain::point);
    ASSERT_EQ(field.size(), 20u);
    EXPECT_EQ(field[0], times[i]);
    EXPECT_EQ(field[19], 4 + times[i]);
  }
}

TEST_F(VtkHdf, AStepMayHaveAMeshOfItsOwn) {
  const ReadResult last = read("moving.vtkhdf");
  EXPECT_EQ(last.mesh.cell_count(), 5u);
  EXPECT_THAT(last.notes, Contains(HasSubstr("the last of 2 time steps")));
  const auto first = read_series_entry({sample_path("moving.vtkhdf"), 1, 0});
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_EQ(first->mesh.cell_count(), 3u);
  EXPECT_EQ(first->mesh.point_count(), 16u);
  const auto none = read_series_entry({sample_path("moving.vtkhdf"), 3, 2});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::usage);
}

TEST_F(VtkHdf, PolyDataComePartByPart) {
  const Mesh mesh = read("surface.vtkhdf").mesh;
  std::vector<CellType> types;
  for (const CellBlock& block : mesh.blocks) types.push_back(block.type);
  EXPECT_THAT(types, ElementsAre(CellType::vertex, CellType::line, CellType::quad, CellType::poly_line,
                                 CellType::polygon, CellType::triangle));
  EXPECT_THAT(mesh.blocks[5].connectivity, ElementsAre(6, 9, 7));  // the first part has four points
  EXPECT_THAT(testing::values_of<int32_t>(mesh, "number", Domain::cell), ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_EQ(mesh.find("n", Domain::point)->role, Role::normal);
}

TEST_F(VtkHdf, NetcdfOfEitherKindIsTheSameExodusMesh) {
  for (const auto& [classic, hdf5] :
       {std::pair("small.e", "small_netcdf4.e"), std::pair("table_of_variables.e", "table_netcdf4.e")}) {
    const ReadResult a = read(classic), b = read(hdf5);
    expect_same_mesh(a.mesh, b.mesh);
    EXPECT_EQ(a.notes, b.notes);
    EXPECT_EQ(read_series(sample_path(classic))->size(), read_series(sample_path(hdf5))->size());
  }
}

TEST_F(VtkHdf, FilesThatWereCutOffAreNamed) {
  const std::string whole = text_of_file(sample_path("ghosts.vtkhdf"));
  for (uint64_t size = 8; size < whole.size(); size += 501) {
    const auto source = memory_source(std::as_bytes(std::span(whole)).first(size), "cut.vtkhdf");
    const auto result = read_mesh(*source, {});
    ASSERT_FALSE(result) << size;
    EXPECT_EQ(result.error().code, ErrorCode::malformed_input);
    EXPECT_THAT(result.error().message, HasSubstr("cut.vtkhdf: "));
  }
}

}  // namespace
}  // namespace maille
