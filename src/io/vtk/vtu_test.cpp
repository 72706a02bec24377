#include "io/vtk/vtu.h"

#include <gmock/gmock.h>

#include "io/format.h"
#include "io/same_mesh.h"
#include "support/random.h"
#include "support/random_volume.h"
#include "support/sample_mesh.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::HasSubstr;
using ::testing::Values;

/// Files VTK 9.1 wrote.
class VtuSamples : public ::testing::TestWithParam<const char*> {};

TEST_P(VtuSamples, GiveTheSampleMesh) {
  const auto result = read_file(vtu_format(), sample_path(GetParam()));
  ASSERT_TRUE(result) << result.error().message;
  expect_same_mesh(result->mesh, sample_mesh());
}

TEST_P(VtuSamples, EveryTruncationIsAnError) {
  const std::string text = text_of_file(sample_path(GetParam()));
  const size_t end = text.rfind('>') + 1;
  for (size_t size = 0; size < end; size += 7) {
    EXPECT_FALSE(read_text(vtu_format(), text.substr(0, size))) << "of " << end << " bytes only " << size;
  }
}

INSTANTIATE_TEST_SUITE_P(Vtk, VtuSamples,
                         Values("ascii.vtu", "base64.vtu", "base64_zlib.vtu", "appended_raw.vtu",
                                "appended_base64.vtu", "appended_lz4.vtu", "appended_lzma.vtu",
                                "appended_zlib_base64.vtu"));

/// A tetrahedron, and a cube given by its faces.
Mesh polyhedra() {
  Mesh mesh = sample_mesh();
  mesh.arrays.clear();
  CellBlock& block = mesh.blocks[0];
  block.types = {10, 42};
  block.offsets = {0, 4, 28};
  block.connectivity = {6, 7, 12, 15, 0,  3, 4, 1, 6, 7,  10, 9, 0, 1,
                        7, 6, 1,  4,  10, 7, 4, 3, 9, 10, 3,  0, 6, 9};
  block.face_sizes = {4, 4, 4, 4, 4, 4};
  block.cell_faces = {0, 0, 6};
  return mesh;
}

TEST(VtuReader, ReadsPolyhedraFromFaceStreams) {
  const auto result = read_file(vtu_format(), sample_path("polyhedra.vtu"));
  ASSERT_TRUE(result) << result.error().message;
  expect_same_mesh(result->mesh, polyhedra());
}

TEST(VtuWriter, ReplacesControlCharactersThatXmlDoesNotHave) {
  Mesh mesh = sample_mesh();
  mesh.arrays.clear();
  mesh.arrays.push_back(make_array(std::string("a\x01\0b\tc", 6), Domain::point, Scalar::f32, 1));
  mesh.arrays.push_back(make_array(std::string("a\x02\0b\tc", 6), Domain::point, Scalar::f32, 1));
  for (Array& array : mesh.arrays) array.resize(mesh.point_count());
  const Written written = write_text(vtu_format(), mesh);
  EXPECT_EQ(written.text.find("&#1;"), std::string::npos);
  EXPECT_EQ(written.text.find("&#0;"), std::string::npos);
  EXPECT_TRUE(has_note(written.notes, "2 names with control characters"));
  const auto back = read_text(vtu_format(), written.text);
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->mesh.arrays.size(), 2u);
  EXPECT_EQ(back->mesh.arrays[0].name, "a\u2401\u2400b\tc");
  EXPECT_EQ(back->mesh.arrays[1].name, "a\u2402\u2400b\tc");
}

std::string file_with_faces(const std::string& faces, const std::string& points = "0 1 2 0 3 1") {
  return R"(<VTKFile type="UnstructuredGrid" version="2.3" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="4" NumberOfCells="2"><Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">
0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>
<DataArray type="Int32" Name="connectivity" format="ascii">0 1 0 1 2 3</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">2 6</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">3 42</DataArray>
<DataArray type="Int32" Name="face_connectivity" format="ascii">)" +
         points + R"(</DataArray>
<DataArray type="Int32" Name="face_offsets" format="ascii">3 6</DataArray>
<DataArray type="Int32" Name="polyhedron_to_faces" format="ascii">)" +
         faces + R"(</DataArray>
<DataArray type="Int32" Name="polyhedron_offsets" format="ascii">0 2</DataArray>
</Cells></Piece></UnstructuredGrid></VTKFile>)";
}

TEST(VtuReader, ReadsPolyhedraFromListsOfFaces) {
  const auto result = read_text(vtu_format(), file_with_faces("1 0"));
  ASSERT_TRUE(result) << result.error().message;
  const CellBlock& block = result->mesh.blocks.at(0);
  EXPECT_EQ(block.connectivity, (std::vector<uint32_t>{0, 1, 0, 3, 1, 0, 1, 2}));
  EXPECT_EQ(block.face_sizes, (std::vector<uint32_t>{3, 3}));
}

TEST(VtuReader, RefusesFacesThatAreNotThere) {
  EXPECT_FALSE(read_text(vtu_format(), file_with_faces("1 2")));
  EXPECT_FALSE(read_text(vtu_format(), file_with_faces("1")));
  EXPECT_FALSE(read_text(vtu_format(), file_with_faces("1 -1")));
  EXPECT_FALSE(read_text(vtu_format(), file_with_faces("1 0", "0 1 2 0 3 4")));
  EXPECT_FALSE(read_text(vtu_format(), file_with_faces("1 0", "0 1 2 0 3")));
}

TEST(VtuReader, JoinsThePiecesOfParallelFiles) {
  const auto result = read_file(vtu_format(), sample_path("pieces.pvtu"));
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  EXPECT_EQ(mesh.point_count(), 32u);
  ASSERT_EQ(mesh.cell_count(), 16u);
  EXPECT_EQ(mesh.blocks[0].connectivity[41], 16u);
  EXPECT_EQ(values_of<int32_t>(mesh, "id", Domain::cell)[8], 1);
}

TEST(VtuReader, OpensNoPieceOutsideOfTheFolder) {
  const auto result =
      read_text(vtu_format(), R"(<VTKFile type="PUnstructuredGrid" version="0.1" byte_order="LittleEndian">
<PUnstructuredGrid GhostLevel="0"><Piece Source="../x.vtu"/></PUnstructuredGrid></VTKFile>)");
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("only files in the same folder or below"));
}

TEST(VtuWriter, GivesBackEveryMeshBitForBit) {
  for (uint64_t seed = 0; seed < 150; ++seed) {
    RandomVolumeOptions options;
    options.position = seed % 3 == 0 ? Scalar::f32 : Scalar::f64;
    const Mesh mesh = random_volume(seed, options);
    WriteOptions write;
    write.big_endian = seed % 4 == 1;
    const auto back = read_text(vtu_format(), write_text(vtu_format(), mesh, write).text);
    ASSERT_TRUE(back) << seed << ": " << back.error().message;
    expect_same_mesh(back->mesh, mesh);
    if (HasFailure()) FAIL() << "seed " << seed;
  }
}

TEST(VtuWriter, AsciiKeepsEveryFiniteNumber) {
  for (uint64_t seed = 0; seed < 60; ++seed) {
    RandomVolumeOptions options;
    options.special_values = false;
    const Mesh mesh = random_volume(seed, options);
    WriteOptions write;
    write.ascii = true;
    const auto back = read_text(vtu_format(), write_text(vtu_format(), mesh, write).text);
    ASSERT_TRUE(back) << seed << ": " << back.error().message;
    expect_same_mesh(back->mesh, mesh);
    if (HasFailure()) FAIL() << "seed " << seed;
  }
}

TEST(VtuWriter, TellsNamesOfBlocksToOthers) {
  RandomVolumeOptions options;
  options.arrays = false;
  Mesh mesh = random_volume(1, options);
  mesh.blocks[0].name = "inlet";
  const std::string text = write_text(vtu_format(), mesh).text;
  EXPECT_THAT(text, HasSubstr("Name=\"block\""));
  EXPECT_THAT(text, HasSubstr("Name=\"block_labels\""));
}

TEST(VtuWriter, KeepsShortFieldDataInTheirTags) {
  Mesh mesh = random_volume(1, {});
  mesh.blocks[0].name = "inlet";
  const std::string text = write_text(vtu_format(), mesh).text;
  const std::string fields = text.substr(0, text.find("<Piece"));
  EXPECT_THAT(fields, HasSubstr("Name=\"maille_block_names\""));
  EXPECT_THAT(fields, ::testing::Not(HasSubstr("appended")));
  for (const bool big_endian : {false, true}) {
    WriteOptions options;
    options.big_endian = big_endian;
    const auto again = read_text(vtu_format(), write_text(vtu_format(), mesh, options).text);
    ASSERT_TRUE(again) << again.error().message;
    expect_same_mesh(again->mesh, mesh);
  }
}

TEST(VtuWriter, SaysThatVtkCannotShowLagrangePyramids) {
  Mesh mesh;
  mesh.points.resize(14);
  mesh.blocks.push_back(
      {"", CellType::lagrange_pyramid, {}, {0, 14}, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13}});
  EXPECT_THAT(write_text(vtu_format(), mesh).notes,
              ::testing::ElementsAre("1 Lagrange pyramid written that VTK 9.1 reads, but cannot show"));
}

TEST(VtuReader, SurvivesRandomDamage) {
  for (const char* name :
       {"ascii.vtu", "appended_lz4.vtu", "base64_zlib.vtu", "polyhedra.vtu", "appended_lzma.vtu"}) {
    const std::string text = text_of_file(sample_path(name));
    Random random(3);
    for (int trial = 0; trial < 300; ++trial) {
      std::string damaged = text;
      for (uint32_t i = random.between(1, 4); i > 0; --i) {
        damaged[random.below(damaged.size())] = static_cast<char>(random.below(256));
      }
      read_text(vtu_format(), damaged);  // checks that what is read is valid
    }
  }
}

}  // namespace
}  // namespace maille
