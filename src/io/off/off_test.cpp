#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "io/same_mesh.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/surface_round_trip.h"

namespace maille {
namespace {

using testing::array_of;
using testing::expect_same_mesh;
using ::testing::HasSubstr;
using testing::read_text;
using testing::values_of;
using testing::write_text;

ReadResult read_off(std::string_view text) {
  return testing::read_good_text(off_format(), text, "test.off");
}

std::string error_of(std::string_view text) {
  return testing::error_of_text(off_format(), text, "test.off");
}

TEST(OffReader, ReadsPolygons) {
  const Mesh mesh = read_off("OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n3 0 1 2\n4 0 1 2 3\n").mesh;
  EXPECT_EQ(mesh.points.type, Scalar::f32);
  EXPECT_EQ(mesh.blocks[0].type, CellType::polygon);
  EXPECT_EQ(mesh.blocks[0].connectivity, (std::vector<uint32_t>{0, 1, 2, 0, 1, 2, 3}));
  EXPECT_TRUE(mesh.arrays.empty());
}

TEST(OffReader, TakesTheFormsOfOtherPrograms) {
  const Mesh expected = read_off("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").mesh;
  for (const char* text : {"OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2", "3 1 3\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
                           "OFF\r\n3 1\r\n\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n3  0 1 2\r\n\r\n",
                           "nOFF 3\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
                           "  OFF\n3\n1\n0 0 0\n1\t0 0\n0 1 0\n\n\n3 0 1\n2\n"}) {
    expect_same_mesh(read_off(text).mesh, expected);
  }
}

TEST(OffReader, EndsTokensAtComments) {
  const Mesh mesh = read_off(
                        "COFF#keyword\n2 2 0#counts\n1 -1 0 0.9 0 0#red\n3 4 0 .5 1 0#green\n"
                        "2 0 1#edge\n2#an edge\n1 0 0.5 0 1#mauve\n#end")
                        .mesh;
  Mesh expected;
  expected.points = array_of<float>("position", Domain::point, Scalar::f32, 3, {1, -1, 0, 3, 4, 0});
  EXPECT_TRUE(mesh.points.bytes == expected.points.bytes);
  EXPECT_EQ(values_of<float>(mesh, "colour", Domain::point), (std::vector<float>{0.9f, 0, 0, 0.5f, 1, 0}));
  EXPECT_EQ(mesh.blocks.at(0).connectivity, (std::vector<uint32_t>{0, 1, 1, 0}));
  EXPECT_EQ(values_of<uint8_t>(mesh, "colour.count", Domain::cell), (std::vector<uint8_t>{0, 3}));
  std::vector<std::string> comments;
  for (const auto& [key, text] : mesh.metadata) comments.push_back(text);
  EXPECT_THAT(comments, ::testing::Contains("red"));
  EXPECT_THAT(comments, ::testing::Contains("mauve"));
}

TEST(OffReader, KeepsComments) {
  const Mesh mesh = read_off("# before\nOFF # keyword\n# made\n1 0 0 # counts\n1 2 3 # point\n#\n").mesh;
  std::vector<std::string> comments;
  for (const auto& [key, text] : mesh.metadata) comments.push_back(text);
  EXPECT_EQ(comments, (std::vector<std::string>{"before", "keyword", "made", "counts", "point", ""}));
}

TEST(OffReader, ReadsEverythingVerticesCanHave) {
  const Mesh mesh =
      read_off("STCN4OFF\n2 0 0\n1 2 3 0.5 0 0 1 1.0 0.5 0.25 1.0 0 1\n4 5 6 1 0 1 0 0.0 0.0 0.0 0.5 1 1\n")
          .mesh;
  EXPECT_EQ(values_of<float>(mesh, "weight", Domain::point), (std::vector<float>{0.5, 1}));
  EXPECT_EQ(values_of<float>(mesh, "normal", Domain::point), (std::vector<float>{0, 0, 1, 0, 1, 0}));
  EXPECT_EQ(values_of<float>(mesh, "colour", Domain::point),
            (std::vector<float>{1, 0.5, 0.25, 1, 0, 0, 0, 0.5}));
  EXPECT_EQ(values_of<float>(mesh, "texcoord", Domain::point), (std::vector<float>{0, 1, 1, 1}));
  EXPECT_EQ(mesh.find("texcoord", Domain::point)->role, Role::texture_coordinate);
}

TEST(OffReader, ReadsColoursOfBytes) {
  const Mesh mesh = read_off("COFF\n2 0 0\n1 2 3 255 0 7\n4 5 6 1 2 3\n").mesh;
  EXPECT_EQ(values_of<uint8_t>(mesh, "colour", Domain::point), (std::vector<uint8_t>{255, 0, 7, 1, 2, 3}));
  const ReadResult undeclared = read_off("OFF\n1 0 0\n1 2 3 255 0 7 9\n");
  EXPECT_EQ(undeclared.mesh.find("colour", Domain::point)->components, 4u);
  EXPECT_EQ(undeclared.notes.size(), 1u);
}

TEST(OffReader, ReadsColoursOfFaces) {
  const std::string points = "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(values_of<uint8_t>(read_off(points + "3 0 1 2 255 0 0\n3 0 1 2 0 255 0\n").mesh, "colour",
                               Domain::cell),
            (std::vector<uint8_t>{255, 0, 0, 0, 255, 0}));
  EXPECT_EQ(values_of<float>(read_off(points + "3 0 1 2 0.5 0 0 1\n3 0 1 2 0 1 0 1\n").mesh, "colour",
                             Domain::cell),
            (std::vector<float>{0.5, 0, 0, 1, 0, 1, 0, 1}));
  EXPECT_EQ(
      values_of<int32_t>(read_off(points + "3 0 1 2 300\n3 0 1 2 -1\n").mesh, "colour_index", Domain::cell),
      (std::vector<int32_t>{300, -1}));
  const Mesh some = read_off(points + "3 0 1 2\n3 0 1 2 0 1.5 0\n").mesh;
  EXPECT_EQ(values_of<float>(some, "colour", Domain::cell), (std::vector<float>{0, 0, 0, 0, 1.5, 0}));
  EXPECT_EQ(values_of<uint8_t>(some, "colour.count", Domain::cell), (std::vector<uint8_t>{0, 3}));
}

TEST(OffReader, NamesWhatIsWrong) {
  const std::string points = "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(error_of(points + "3 0 1 2\n3 0 1 3\n"),
            "test.off: line 7: face 1: vertex 3 does not exist, there are 3");
  EXPECT_EQ(error_of(points + "3 0 1 2\n3 0 1 -1\n"),
            "test.off: line 7: face 1: vertex -1 does not exist, there are 3");
  EXPECT_EQ(error_of(points + "3 0 1 2\nx 0 1 2\n"),
            "test.off: line 7: face 1 has \"x\" where its degree belongs");
  EXPECT_EQ(error_of(points + "3 0 1 2\n"), "test.off: line 7: the file ends at face 1 of 2");
  EXPECT_EQ(error_of(points + "3 0 1 2 1 2 3 4 5\n"), "test.off: line 6: face 0 has \"5\" behind its colour");
  EXPECT_EQ(error_of("OFF\n3 2 0\n0 0 0\n1 0\n"), "test.off: line 4: vertex 1 has 2 numbers instead of 3");
  EXPECT_EQ(error_of("OFF\n3 2 0\n0 0 0\n1 0 zero\n"),
            "test.off: line 4: vertex 1 has \"zero\" where a number belongs");
  EXPECT_EQ(error_of("OFF\n1 0 0\n-1e400 0 0\n"),
            "test.off: line 3: vertex 0 has \"-1e400\", which is too large for a double");
  EXPECT_EQ(error_of("OFF\n3 2 0\n0 0 0\n"), "test.off: line 4: the file ends at vertex 1 of 3");
  EXPECT_EQ(error_of("OFF\nmany 2 0\n"),
            "test.off: line 2: \"many\" stands where the number of vertices belongs");
  EXPECT_EQ(error_of("OFF\n3 -2 0\n"), "test.off: line 2: \"-2\" stands where the number of faces belongs");
  EXPECT_EQ(error_of("XOFF\n"), "test.off: line 1: unknown keyword \"XOFF\"");
  EXPECT_EQ(error_of("solid\n"), "test.off: line 1: \"solid\" stands where the keyword OFF belongs");
  EXPECT_EQ(error_of("4nOFF 4\n"), "test.off: line 1: nOFF with a dimension other than 3 is not supported");
}

TEST(OffReader, DoesNotBelieveTheCounts) {
  EXPECT_THAT(error_of("OFF\n4000000000 4000000000 0\n0 0 0\n"), HasSubstr("vertex 1 of 4000000000"));
  EXPECT_THAT(error_of("OFF\n18446744073709551615 1 0\n0 0 0\n"), HasSubstr("more than 2^32 - 2 vertices"));
  EXPECT_THAT(error_of("OFF\n1 1 0\n0 0 0\n18446744073709551615 0 0 0\n"), HasSubstr("vertex 4 of"));
}

constexpr const char* golden = R"(STCN4OFF
# made by hand
#
3 2 0
0 0 0 0.5 0 0 1 255 0 1 0.5 0.25
1 0 0.1 1 0 0 1 1 2 3 0 0
0 1 -0 2 0 0 1 0 0 0 1 1
3 0 1 2 1.0 0.5 0.0
2 0 1
)";

TEST(OffWriter, RestoresAFile) {
  const testing::Written written = write_text(off_format(), read_off(golden).mesh);
  EXPECT_TRUE(written.notes.empty());
  EXPECT_EQ(written.text, golden);
}

TEST(OffReader, RejectsEveryTruncation) {
  const std::string text = golden;
  for (size_t length = 0; length < text.size() - 2; ++length) {
    const auto result = read_text(off_format(), text.substr(0, length), "test.off");
    EXPECT_FALSE(result) << length;
    if (!result) {
      EXPECT_EQ(result.error().code, ErrorCode::malformed_input) << length;
    }
  }
}

TEST(OffWriter, GivesBackTheTypesOfNumbers) {
  Mesh mesh = read_off("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").mesh;
  mesh.points = array_of<double>("position", Domain::point, Scalar::f64, 3, {0, 0, 0, 0.1, 1, 1, 2, 2, 2});
  mesh.arrays.push_back(
      array_of<double>("normal", Domain::point, Scalar::f64, 3, {0, 0, 1, 0, 0, 1, 0, 0, 1}, Role::normal));
  mesh.arrays.push_back(
      array_of<float>("colour", Domain::point, Scalar::f32, 3, {0, 0, 1, 0, 0, 1, 0, 0, 1}, Role::colour));
  mesh.arrays.push_back(array_of<double>("colour", Domain::cell, Scalar::f64, 3, {0, 1, 255}, Role::colour));
  const testing::Written written = write_text(off_format(), mesh);
  EXPECT_THAT(written.text, HasSubstr("# maille f64 position normal face_colour\n"));
  expect_same_mesh(read_off(written.text).mesh, mesh);
}

TEST(OffWriter, SaysWhatItLeavesOut) {
  Mesh mesh = read_off("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").mesh;
  mesh.blocks.push_back({"edges", CellType::line, {}, {}, {0, 1}});
  mesh.arrays.push_back(array_of<float>("height", Domain::point, Scalar::f32, 1, {1, 2, 3}));
  mesh.metadata.emplace_back("mtllib", "a.mtl");
  EXPECT_EQ(
      write_text(off_format(), mesh).notes,
      (std::vector<std::string>{"1 cell that are not faces left out", "array \"height\" on points left out",
                                "the names of 1 block left out", "metadata \"mtllib\" left out"}));
}

RC_GTEST_PROP(OffRoundTrip, IsExact, (uint64_t seed)) {
  testing::RandomMeshOptions options;
  options.several_blocks = false;
  options.any_position_type = false;
  options.special_values = false;
  options.arrays = false;
  Mesh mesh = testing::random_surface(seed, options);
  testing::Random random(seed);
  const auto add = [&](const char* name, Domain domain, uint32_t components, Role role) {
    testing::add_array(mesh, random, name, domain, components, role);
  };
  if (random.chance(50)) add("colour", Domain::point, random.between(3, 4), Role::colour);
  if (random.chance(50)) add("texcoord", Domain::point, 2, Role::texture_coordinate);
  if (random.chance(50)) add("normal", Domain::point, 3, Role::normal);
  if (random.chance(50)) add("colour", Domain::cell, random.between(3, 4), Role::colour);
  RC_ASSERT(testing::same_surface(read_off(write_text(off_format(), mesh).text).mesh, mesh));
}

}  // namespace
}  // namespace maille
