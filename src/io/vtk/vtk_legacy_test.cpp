#include "io/vtk/vtk_legacy.h"

#include <gmock/gmock.h>

#include "io/format.h"
#include "io/same_mesh.h"
#include "support/random.h"
#include "support/random_volume.h"
#include "support/sample_mesh.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Values;

/// Files VTK 9.1 wrote.
class VtkSamples : public ::testing::TestWithParam<const char*> {};

TEST_P(VtkSamples, GiveTheSampleMesh) {
  const auto result = read_file(vtk_legacy_format(), sample_path(GetParam()));
  ASSERT_TRUE(result) << result.error().message;
  Mesh expected = sample_mesh();
  if (std::string_view(GetParam()).starts_with("ascii")) {
    // VTK prints fewer digits than a double has.
    ASSERT_EQ(result->mesh.arrays.size(), 3u);
    expected.arrays[0] = result->mesh.arrays[0];
  }
  expect_same_mesh(result->mesh, expected);
}

INSTANTIATE_TEST_SUITE_P(Vtk, VtkSamples,
                         Values("ascii_42.vtk", "binary_42.vtk", "ascii_51.vtk", "binary_51.vtk"));

TEST(VtkReader, ReadsPolyhedra) {
  for (const char* name : {"polyhedra_42.vtk", "polyhedra_51.vtk"}) {
    const auto result = read_file(vtk_legacy_format(), sample_path(name));
    ASSERT_TRUE(result) << result.error().message;
    const CellBlock& block = result->mesh.blocks.at(0);
    EXPECT_THAT(block.types, ElementsAre(10, 42));
    EXPECT_THAT(block.face_sizes, ElementsAre(4, 4, 4, 4, 4, 4));
    EXPECT_EQ(block.connectivity.size(), 28u);
  }
}

std::string text_of(const std::string& rest) {
  return "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET " + rest;
}

TEST(VtkReader, ReadsAttributesOfAllKinds) {
  const auto result = read_text(vtk_legacy_format(), text_of(R"(POLYDATA
POINTS 3 float
0 0 0 1 0 0 0 1 0
POLYGONS 1 4
3 0 1 2
POINT_DATA 3
SCALARS s%20t double
LOOKUP_TABLE mine
0.1 nan 3
LOOKUP_TABLE mine 2
0 0 0 1 1 1 1 1
METADATA
INFORMATION 1
NAME X LOCATION Y

SCALARS two int 2
LOOKUP_TABLE default
1 2 3 4 5 6
NORMALS n float
0 0 1 0 0 1 0 0 1
TEXTURE_COORDINATES uv 2 float
0 0 1 0 0 1
CELL_DATA 1
VECTORS v float
1 2 3
TENSORS t double
1 2 3 4 5 6 7 8 9
)"));
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  EXPECT_EQ(values_of<double>(mesh, "s t", Domain::point)[0], 0.1);
  EXPECT_EQ(mesh.find("two", Domain::point)->components, 2u);
  EXPECT_EQ(mesh.find("n", Domain::point)->role, Role::normal);
  EXPECT_EQ(mesh.find("uv", Domain::point)->role, Role::texture_coordinate);
  EXPECT_EQ(mesh.find("v", Domain::cell)->components, 3u);
  EXPECT_EQ(mesh.find("t", Domain::cell)->components, 9u);
  EXPECT_EQ(mesh.find("lookup_table mine", Domain::mesh)->count(), 2u);
  EXPECT_THAT(mesh.metadata, ElementsAre(std::pair<std::string, std::string>("vtk.title", "title")));
}

TEST(VtkReader, ManySectionsOfMetadataAreSkipped) {
  std::string text = "UNSTRUCTURED_GRID\nPOINTS 1 float\n0 0 0\n";
  for (int i = 0; i < 1'000'000; ++i) text += "METADATA\n\n";
  const auto result = read_text(vtk_legacy_format(), text_of(text));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.point_count(), 1u);
}

TEST(VtkReader, TextsAreHeldWithinTheLimitsOnly) {
  std::string text = text_of("POLYDATA\nFIELD f 1\nnames 1 200000 string\n");
  for (int i = 0; i < 100'000; ++i) text += "abc\n";
  const auto source = memory_source(std::as_bytes(std::span(text.data(), text.size())), "x");
  ReadOptions options;
  options.limits.mesh_bytes = 1 << 20;
  const auto result = vtk_legacy_format().read(*source, options);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::memory_bound) << result.error().message;
}

TEST(VtkReader, GridsBecomeHexahedra) {
  const auto image =
      read_text(vtk_legacy_format(), text_of("STRUCTURED_POINTS\nDIMENSIONS 3 2 2\nORIGIN 1 0 0\nSPACING .5 "
                                             "1 2\nCELL_DATA 2\nSCALARS a int\nLOOKUP_TABLE default\n1 2\n"));
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->mesh.blocks[0].type, CellType::hexahedron);
  EXPECT_THAT(image->mesh.blocks[0].connectivity,
              ElementsAre(0, 1, 4, 3, 6, 7, 10, 9, 1, 2, 5, 4, 7, 8, 11, 10));
  EXPECT_EQ(image->mesh.points.values<double>()[3 * 11], 2.0);
  const auto lines =
      read_text(vtk_legacy_format(), text_of("RECTILINEAR_GRID\nDIMENSIONS 2 1 3\nX_COORDINATES 2 float\n0 "
                                             "1\nY_COORDINATES 1 float\n5\nZ_COORDINATES 3 float\n0 1 2\n"));
  ASSERT_TRUE(lines) << lines.error().message;
  EXPECT_EQ(lines->mesh.blocks[0].type, CellType::quad);
  EXPECT_THAT(lines->mesh.blocks[0].connectivity, ElementsAre(0, 1, 3, 2, 2, 3, 5, 4));
}

TEST(VtkReader, NamesWhatIsWrong) {
  const auto expect = [](const std::string& text, const std::string& message) {
    const auto result = read_text(vtk_legacy_format(), text);
    ASSERT_FALSE(result) << text;
    EXPECT_THAT(result.error().message, HasSubstr(message));
  };
  const std::string points = "UNSTRUCTURED_GRID\nPOINTS 1 float\n0 0 0\n";
  expect(text_of(points + "CELLS 1 2\n1 1\nCELL_TYPES 1\n1\n"),
         "cell 0 uses point 1, but there are 1 points");
  expect(text_of(points + "CELLS 1 2\n2 0\nCELL_TYPES 1\n1\n"), "line 8: cell 0 goes beyond");
  expect(text_of(points + "CELLS 1 2\n1 0\n"), "there are 1 cells but types of 0");
  expect(text_of(points + "CELLS 1000000000 2000000000\n1 0\n"), "more cells announced");
  expect(text_of("UNSTRUCTURED_GRID\nPOINTS 3 float\n0 0 0 x"), "line 6: there should be value 3 of 9");
  expect(text_of("UNSTRUCTURED_GRID\nPOINTS 300000000 float\n0 0 0 1"), "more values than the file can hold");
  expect(text_of("STRUCTURED_POINTS\nDIMENSIONS 4000000 4000000 400\n"), "2^32 points");
  expect(text_of("STRUCTURED_POINTS\nDIMENSIONS 400 400 400\n"),
         "far beyond what a file of this size can hold");
  expect(text_of(points + "BANANA 1\n"), "is no keyword");
  expect(text_of("TABLE\n"), "which cannot be read");
}

TEST(VtkWriter, GivesBackEveryMeshBitForBit) {
  for (uint64_t seed = 0; seed < 150; ++seed) {
    RandomVolumeOptions options;
    options.position = seed % 3 == 0 ? Scalar::f32 : Scalar::f64;
    options.special_values = seed % 2 == 0;
    const Mesh mesh = random_volume(seed, options);
    WriteOptions write;
    write.ascii = seed % 2 == 1;
    const auto back = read_text(vtk_legacy_format(), write_text(vtk_legacy_format(), mesh, write).text);
    ASSERT_TRUE(back) << seed << ": " << back.error().message;
    expect_same_mesh(back->mesh, mesh);
    if (HasFailure()) FAIL() << "seed " << seed;
  }
}

TEST(VtkReader, SurvivesRandomDamageAndCuts) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    WriteOptions write;
    write.ascii = seed % 2 == 1;
    const std::string text = write_text(vtk_legacy_format(), random_volume(seed), write).text;
    Random random(seed);
    for (int trial = 0; trial < 60; ++trial) {
      std::string damaged = text.substr(0, random.chance(30) ? random.below(text.size()) : text.size());
      for (uint32_t i = random.between(0, 4); i > 0 && !damaged.empty(); --i) {
        damaged[random.below(std::min<size_t>(damaged.size(), random.chance(50) ? 400 : damaged.size()))] =
            static_cast<char>(random.chance(50) ? '0' + random.below(10) : random.below(256));
      }
      read_text(vtk_legacy_format(), damaged);  // checks that what is read is valid
    }
  }
}

}  // namespace
}  // namespace maille
