// The files were written by meshio (tests/formats/xdmf/make.py).
#include "io/xdmf/xdmf.h"

#include <gmock/gmock.h>
#include <maille/series.h>

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

Result<ReadResult> read_xdmf_text(const std::string& text) {
  return read_mesh(*memory_source(std::as_bytes(std::span(text)), "x.xdmf"), {});
}

/// A Domain with these grids.
std::string in_domain(const std::string& grids) {
  return "<Xdmf><Domain>" + grids + "</Domain></Xdmf>";
}

std::string uniform_grid(const std::string& topology, const std::string& more = "") {
  return "<Grid Name='a'><Geometry GeometryType='XY'><DataItem Dimensions='3 2'>0 0 1 0 0 "
         "1</DataItem></Geometry>"
         "<Topology " +
         topology + "</DataItem></Topology>" + more + "</Grid>";
}
const std::string triangle = "TopologyType='Triangle'><DataItem NumberType='Int' Dimensions='1 3'>0 1 2";

TEST(Xdmf, MixedCellsAndTheirArraysAreThoseOfMeshio) {
  const auto result = read_mesh(sample_path("xdmf/mixed_xml.xdmf"));
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  ASSERT_EQ(mesh.blocks.size(), 3u);
  EXPECT_THAT(mesh.blocks[0].connectivity, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  EXPECT_THAT(mesh.blocks[1].connectivity, ElementsAre(1, 8, 9, 5));
  EXPECT_EQ(mesh.blocks[2].type, CellType::triangle);
  EXPECT_EQ(mesh.points.type, Scalar::f64);
  EXPECT_EQ(mesh.points.values<double>()[29], 0.5);
  EXPECT_EQ(mesh.find("T", Domain::point)->values<double>()[9], 13.5);
  EXPECT_EQ(mesh.find("v", Domain::point)->components, 3u);
  const auto ids = mesh.find("id", Domain::cell)->values<int64_t>();
  EXPECT_THAT(std::vector(ids.begin(), ids.end()), ElementsAre(1, 2, 3, 4));
}

TEST(Xdmf, ValuesInHdf5AreTheSame) {
  const auto text = read_mesh(sample_path("xdmf/mixed_xml.xdmf"));
  const auto hdf5 = read_mesh(sample_path("xdmf/mixed_hdf.xdmf"));
  if (!hdf5 && hdf5.error().code == ErrorCode::unsupported) GTEST_SKIP() << hdf5.error().message;
  ASSERT_TRUE(text && hdf5);
  expect_same_mesh(text->mesh, hdf5->mesh);
  EXPECT_THAT(text->files_beside, ElementsAre());
  EXPECT_THAT(hdf5->files_beside, ElementsAre(sample_path("xdmf/mixed_hdf.h5")));
}

TEST(Xdmf, StepsShareAMeshByXInclude) {
  const auto steps = read_series(sample_path("xdmf/series.xdmf"));
  ASSERT_TRUE(steps) << steps.error().message;
  ASSERT_EQ(steps->size(), 2u);
  EXPECT_EQ((*steps)[1].time, 0.5);
  for (size_t i = 0; i < 2; ++i) {
    const auto step = read_series_entry((*steps)[i]);
    ASSERT_TRUE(step) << step.error().message;
    EXPECT_EQ(step->mesh.cell_count(), 2u);
    EXPECT_EQ(step->mesh.find("T", Domain::point)->values<double>()[9], 9 + (*steps)[i].time);
  }
  const auto none = read_series_entry({sample_path("xdmf/series.xdmf"), 3, 2});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::usage);
}

TEST(Xdmf, GridsOfACollectionAreNamedBlocks) {
  const std::string values =
      "<Attribute Name='q' Center='Cell'><DataItem>7</DataItem></Attribute><Attribute Name='f' "
      "Center='Face'/>";
  const auto result =
      read_xdmf_text(in_domain("<Grid GridType='Collection' CollectionType='Spatial'>" +
                               uniform_grid(triangle) + uniform_grid(triangle, values) + "</Grid>"));
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->mesh.blocks.size(), 1u);  // both are called "a"
  EXPECT_EQ(result->mesh.blocks[0].name, "a");
  EXPECT_THAT(result->mesh.blocks[0].connectivity, ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_EQ(result->mesh.find("q", Domain::cell)->values<float>()[1], 7);
  EXPECT_NE(result->mesh.find("q", Domain::cell)->values<float>()[0], 0);  // NaN
  EXPECT_THAT(result->notes, Contains(HasSubstr("Attribute \"f\" at face left out")));
}

TEST(Xdmf, WhatIsWrongIsSaid) {
  const auto expect = [](const std::string& text, const std::string& message) {
    const auto result = read_xdmf_text(text);
    ASSERT_FALSE(result) << text;
    EXPECT_THAT(result.error().message, HasSubstr("x.xdmf: "));
    EXPECT_THAT(result.error().message, HasSubstr(message));
  };
  const auto topology = [](const std::string& of) { return in_domain(uniform_grid(of)); };
  expect("<Xdmf><Domain>", "no XML");
  expect("<Xdmf/>", "a Domain and a Grid");
  expect(in_domain("<Grid Name='a'/>"), "grid \"a\" has no Topology");
  expect(topology("TopologyType='Triangle'><DataItem NumberType='Int'>0 1 3"), "uses point 3");
  expect(topology("TopologyType='Triangle'><DataItem NumberType='Int'>0 1"), "3 points for each cell");
  expect(topology("TopologyType='Triangle'><DataItem NumberType='Int'>0 1 x"), "found \"x\"");
  expect(topology("TopologyType='Hexahedron_27'><DataItem NumberType='Int'>0"),
         "\"hexahedron_27\" cannot be read");
  expect(topology("TopologyType='Mixed'><DataItem NumberType='Int'>4 0 1"), "ends inside a cell");
  expect(topology("TopologyType='Mixed'><DataItem NumberType='Int'>3 -1 0"), "ends inside a cell");
  expect(topology("TopologyType='Triangle'><DataItem Format='HDF'>../up.h5:/a"),
         "only files in the same folder");
  expect(topology("TopologyType='Triangle'><DataItem Format='Binary'>a.bin"), "\"binary\" cannot be read");
  expect(in_domain(uniform_grid(triangle, "<Attribute Name='q'><DataItem>1 2</DataItem></Attribute>")),
         "has 2 values for 3 points");
  expect(in_domain("<Grid GridType='Collection' CollectionType='Temporal'><Grid/></Grid>"), "no Time");
}

TEST(Xdmf, SurvivesRandomDamage) {
  testing::expect_to_survive_damage(text_of_file(sample_path("xdmf/series.xdmf")), "x.xdmf", 2000,
                                    "0123456789<>/\"=- eMX");
}

}  // namespace
}  // namespace maille
