#include "io/vtk/vtk_text.h"

#include <gmock/gmock.h>

#include "io/format.h"
#include "io/same_mesh.h"
#include "support/random_volume.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using Texts = std::vector<std::string>;

/// Two points, two cells (vertices), text on all that can have some.
constexpr const char* with_texts =
    R"(<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid><FieldData>
<Array type="String" Name="materials" NumberOfTuples="3" format="ascii">97 0 98 99 0 97 0</Array>
<Array type="String" Name="title" NumberOfTuples="1" format="ascii">104 105 0</Array></FieldData>
<Piece NumberOfPoints="2" NumberOfCells="2"><PointData>
<Array type="String" Name="tag" NumberOfComponents="1" format="ascii">120 0 0</Array></PointData><CellData>
<Array type="String" Name="part" NumberOfComponents="2" format="ascii">120 0 121 0 121 0 122 0</Array></CellData>
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0</DataArray></Points><Cells>
<DataArray type="Int32" Name="connectivity" format="ascii">0 1</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">1 2</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">1 1</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>)";

void expect_texts(const Mesh& mesh) {
  ASSERT_EQ(mesh.arrays.size(), 3u);
  EXPECT_EQ(vtk_texts_of(*mesh.find("materials", Domain::mesh)), (Texts{"a", "bc", "a"}));
  EXPECT_EQ(vtk_texts_of(*mesh.find("tag", Domain::point)), (Texts{"x", ""}));
  EXPECT_EQ(vtk_texts_of(*mesh.find("part", Domain::cell)), (Texts{"x", "y", "y", "z"}));
  EXPECT_EQ(mesh.find("part", Domain::cell)->components, 2u);
  EXPECT_EQ(mesh.metadata[0].second, "hi");
}

TEST(VtkText, IsKeptOnPointsCellsAndTheMesh) {
  const auto result = read_text(vtu_format(), with_texts);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_TRUE(result->notes.empty());
  expect_texts(result->mesh);
}

TEST(VtkText, ComesBackAsTextFromEachFormatOfVtk) {
  const Mesh mesh = read_text(vtu_format(), with_texts)->mesh;
  for (const Format* format : {&vtu_format(), &vtp_format(), &vtk_legacy_format()}) {
    for (const bool ascii : {false, true}) {
      WriteOptions options;
      options.ascii = ascii;
      const std::string text = write_text(*format, mesh, options).text;
      EXPECT_THAT(text, Not(HasSubstr("_labels")));
      EXPECT_THAT(text, Not(HasSubstr("maille_text")));
      const auto back = read_text(*format, text);
      ASSERT_TRUE(back) << back.error().message;
      expect_texts(back->mesh);
    }
  }
}

TEST(VtkText, GetsTheSameNumbersInAllPieces) {
  VtkTexts texts;
  Mesh mesh;
  mesh.arrays.push_back(texts.numbers("x", Domain::mesh, 1, {"a", "b"}));
  const Array more = texts.numbers("x", Domain::mesh, 1, {"c", "b"});
  mesh.arrays[0].bytes.insert(mesh.arrays[0].bytes.end(), more.bytes.begin(), more.bytes.end());
  texts.finish(mesh);
  EXPECT_EQ(vtk_texts_of(mesh.arrays[0]), (Texts{"a", "b", "c", "b"}));
  EXPECT_THAT(mesh.metadata, ElementsAre(std::pair<std::string, std::string>("vtk.text", "mesh x")));
}

TEST(VtkText, NamesAndMetadataOfOthersAreWrittenWithoutStrings) {
  RandomVolumeOptions options;
  for (uint64_t seed = 0; seed < 30; ++seed) {
    Mesh mesh = random_volume(seed, options);
    if (!mesh.blocks.empty()) mesh.blocks[0].name = "inlet";
    mesh.metadata.emplace_back("comment", "of a PLY file");
    for (const Format* format : {&vtu_format(), &vtk_legacy_format()}) {
      const std::string text = write_text(*format, mesh).text;
      EXPECT_THAT(text, Not(HasSubstr("\"String\"")));
      EXPECT_THAT(text, Not(HasSubstr(" string\n")));
    }
  }
}

TEST(VtkText, FilesOfOneBlockWithoutANameSayNothingOfBlocks) {
  const Mesh mesh = read_text(vtu_format(), with_texts)->mesh;
  for (const Format* format : {&vtu_format(), &vtk_legacy_format()})
    EXPECT_THAT(write_text(*format, mesh).text, Not(HasSubstr("maille_block")));
}

}  // namespace
}  // namespace maille
