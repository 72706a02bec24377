#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "io/obj/obj.h"
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

ReadResult read_obj(std::string_view text) {
  return testing::read_good_text(obj_format(), text, "test.obj");
}

std::string error_of(std::string_view text) {
  return testing::error_of_text(obj_format(), text, "test.obj");
}

std::vector<std::string> labels_of(const Mesh& mesh, const std::string& name) {
  std::vector<std::string> labels;
  for (const uint32_t value : values_of<uint32_t>(mesh, name, Domain::cell)) {
    labels.push_back(mesh.find(name, Domain::cell)->labels.at(value));
  }
  return labels;
}

const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(ObjReader, ReadsPolygons) {
  const Mesh mesh = read_obj(square + "v 2 2 2\nf 1 2 3\nf 1 2 3 4\nf 5 4 3 2 1\n").mesh;
  EXPECT_EQ(mesh.points.type, Scalar::f32);
  EXPECT_EQ(mesh.point_count(), 5u);
  ASSERT_EQ(mesh.blocks.size(), 1u);
  EXPECT_EQ(mesh.blocks[0].type, CellType::polygon);
  EXPECT_EQ(mesh.blocks[0].offsets, (std::vector<uint64_t>{0, 3, 7, 12}));
  EXPECT_EQ(mesh.blocks[0].connectivity, (std::vector<uint32_t>{0, 1, 2, 0, 1, 2, 3, 4, 3, 2, 1, 0}));
}

TEST(ObjReader, NotesThatMaterialsStayInTheirFiles) {
  const std::string left_out =
      "not part of the mesh, left out: all of materials but their names; the rest stays in ";
  EXPECT_EQ(read_obj("mtllib a b.mtl\n" + square).notes, std::vector<std::string>{left_out + "a b.mtl"});
  EXPECT_EQ(read_obj("mtllib a.mtl\nmtllib b.mtl\nmtllib c.mtl\n" + square).notes,
            std::vector<std::string>{left_out + "a.mtl and 2 others"});
  EXPECT_TRUE(read_obj("usemtl steel\n" + square).notes.empty());
}

TEST(ObjReader, RefusesWhatIsNoObj) {
  const std::string no_obj = "test.obj: no vertex, face or other OBJ statement found; is it another format?";
  EXPECT_EQ(error_of(""), no_obj);
  EXPECT_EQ(error_of(" \n\n"), no_obj);
  EXPECT_EQ(error_of("# only a heading\n"), no_obj);
  EXPECT_EQ(error_of("eggs\n2 leeks\nbread\n"), no_obj);
  EXPECT_EQ(error_of("g eggs\nbutter, 200\n"), no_obj);
  EXPECT_EQ(error_of("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"), no_obj);
  EXPECT_EQ(error_of(std::string_view("\x7f\0\x01\xff\n\x80\r\r\x90", 8)), no_obj);
  EXPECT_EQ(read_obj("mtllib a.mtl\no nothing\n").mesh.point_count(), 0u);
  EXPECT_EQ(read_obj(write_text(obj_format(), Mesh{}).text).mesh.cell_count(), 0u);
}

TEST(ObjReader, UsesCompactBlocks) {
  EXPECT_EQ(read_obj(square + "f 1 2 3\nf 1 3 4\n").mesh.blocks[0].type, CellType::triangle);
  EXPECT_EQ(read_obj(square + "f 1 2 3 4\n").mesh.blocks[0].type, CellType::quad);
}

TEST(ObjReader, CountsNegativeIndicesBackwards) {
  const Mesh mesh = read_obj(square + "f -4 -3 -2\nv 9 9 9\nf -1 -2 1\n").mesh;
  EXPECT_EQ(mesh.blocks[0].connectivity, (std::vector<uint32_t>{0, 1, 2, 4, 3, 0}));
}

TEST(ObjReader, TakesFacesBeforeTheirVertices) {
  const Mesh mesh = read_obj("f 1 2 3\n" + square).mesh;
  EXPECT_EQ(mesh.blocks[0].connectivity, (std::vector<uint32_t>{0, 1, 2}));
}

TEST(ObjReader, PutsSeamsOnCorners) {
  const ReadResult result = read_obj(square +
                                     "vt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.5\nvn 0 0 1\n"
                                     "f 1/1/1 2/2/1 3/3/1\nf 1/4/1 3/3/1 4//1\n");
  const std::vector<float> texcoords = values_of<float>(result.mesh, "texcoord", Domain::corner);
  ASSERT_EQ(texcoords.size(), 12u);
  EXPECT_EQ(texcoords[6], 0.5f);
  EXPECT_TRUE(std::isnan(texcoords[10]) && std::isnan(texcoords[11]));
  EXPECT_EQ(values_of<float>(result.mesh, "normal", Domain::corner).size(), 18u);
  EXPECT_EQ(result.mesh.find("normal", Domain::corner)->role, Role::normal);
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_EQ(result.notes[0], "1 corner without texcoord; NaN");
}

TEST(ObjReader, PutsWhatFollowsThePointsOnPoints) {
  const Mesh mesh = read_obj(square +
                             "vt 0 0 0.5\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\n"
                             "f 1/1/1 2/2/2 3/3/3\n")
                        .mesh;
  EXPECT_EQ(values_of<float>(mesh, "texcoord", Domain::point),
            (std::vector<float>{0, 0, 0.5, 1, 0, 0, 1, 1, 0, 0, 1, 0}));
  EXPECT_TRUE(mesh.find("normal", Domain::point));
  EXPECT_FALSE(mesh.find("normal", Domain::corner));
}

TEST(ObjReader, KeepsWhatNoFaceRefersTo) {
  const ReadResult points = read_obj("v 0 0 0\nvn 0 0 1\nv 1 0 0\nvn 0 1 0\n");
  EXPECT_TRUE(points.mesh.find("normal", Domain::point));
  const ReadResult unused = read_obj(square + "vt 7 8\nf 1 2 3\n");
  EXPECT_EQ(values_of<float>(unused.mesh, "texcoord", Domain::mesh), (std::vector<float>{7, 8}));
  EXPECT_EQ(unused.notes.size(), 1u);
  const ReadResult some = read_obj(square + "vt 7 8\nvt 1 1\nf 1/1 2/1 3/1\n");
  EXPECT_EQ(some.notes, std::vector<std::string>{"1 texcoord left out that no corner refers to"});
}

TEST(ObjReader, KeepsColoursAndWeights) {
  const Mesh mesh = read_obj("v 0 0 0 1 0.5 0\nv 1 1 1 0 0 1\n").mesh;
  EXPECT_EQ(values_of<float>(mesh, "colour", Domain::point), (std::vector<float>{1, 0.5, 0, 0, 0, 1}));
  EXPECT_EQ(mesh.find("colour", Domain::point)->role, Role::colour);
  EXPECT_EQ(values_of<float>(read_obj("v 0 0 0 0.5\nv 0 0 0 2\n").mesh, "weight", Domain::point),
            (std::vector<float>{0.5, 2}));
  const ReadResult some = read_obj("v 0 0 0\nv 1 1 1 0 0 1\nv 0 0 0 1 1 1 0.5\n");
  const std::vector<float> colours = values_of<float>(some.mesh, "colour", Domain::point);
  ASSERT_EQ(colours.size(), 12u);
  EXPECT_TRUE(std::isnan(colours[0]) && std::isnan(colours[3]));
  EXPECT_EQ(colours[7], 1);
  EXPECT_EQ(colours[11], 0.5f);
}

TEST(ObjReader, KeepsNamesAsLabels) {
  const Mesh mesh = read_obj(square +
                             "f 1 2 3\no left wing\ng a b\nusemtl steel\ns 1\nf 1 2 4\nf 1 3 4\n"
                             "usemtl\ns off\nf 2 3 4\no left wing\nusemtl steel\nl 1 2\np 3\n")
                        .mesh;
  EXPECT_EQ(labels_of(mesh, "object"),
            (std::vector<std::string>{"", "left wing", "left wing", "left wing", "left wing", "left wing"}));
  EXPECT_EQ(labels_of(mesh, "group"), (std::vector<std::string>{"", "a b", "a b", "a b", "a b", "a b"}));
  EXPECT_EQ(labels_of(mesh, "material"),
            (std::vector<std::string>{"", "steel", "steel", "", "steel", "steel"}));
  EXPECT_EQ(labels_of(mesh, "smoothing"), (std::vector<std::string>{"", "1", "1", "off", "off", "off"}));
  EXPECT_EQ(mesh.find("material", Domain::cell)->labels.size(), 2u);
  EXPECT_EQ(mesh.find("material", Domain::cell)->role, Role::label);
}

TEST(ObjReader, ReadsLinesAndPoints) {
  const Mesh mesh = read_obj(square + "l 1 2\nf 1 2 3\np 4\nl 3 4\n").mesh;
  ASSERT_EQ(mesh.blocks.size(), 3u);
  EXPECT_EQ(mesh.blocks[0].type, CellType::triangle);
  EXPECT_EQ(mesh.blocks[1].type, CellType::line);
  EXPECT_EQ(mesh.blocks[1].connectivity, (std::vector<uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(mesh.blocks[2].type, CellType::vertex);
  const Mesh longer = read_obj(square + "l 1 2 3\np 1 2\n").mesh;
  EXPECT_EQ(longer.blocks[0].type, CellType::poly_line);
  EXPECT_EQ(longer.blocks[1].type, CellType::poly_vertex);
}

TEST(ObjReader, KeepsCommentsAndLibraries) {
  const Mesh mesh = read_obj("# made by hand\n#\n#tight\nmtllib a file.mtl\n" + square + "# the end").mesh;
  const std::vector<std::pair<std::string, std::string>> expected = {{"comment", "made by hand"},
                                                                     {"comment", ""},
                                                                     {"comment", "tight"},
                                                                     {"mtllib", "a file.mtl"},
                                                                     {"comment", "the end"}};
  EXPECT_EQ(mesh.metadata, expected);
}

TEST(ObjReader, ContinuesLines) {
  const Mesh mesh = read_obj("v 0 \\\n 0 0\nv 1 0 0\\\r\n\nv 0 1 0\nf 1 \\\n2\\\n 3\n").mesh;
  EXPECT_EQ(mesh.point_count(), 3u);
  EXPECT_EQ(mesh.blocks[0].connectivity, (std::vector<uint32_t>{0, 1, 2}));
  EXPECT_EQ(error_of("v 0 \\\n 0 0\nf 1 2 x\n"),
            "test.obj: line 3: face 1: \"x\" stands where an index belongs");
}

TEST(ObjReader, TakesTheFormsOfOtherPrograms) {
  const Mesh mesh =
      read_obj("\r\n  v\t0 0  0 \r\nv 1e0 +0 -0\t# here\r\nv 0 1. .0\r\nf  1// 2// 3// \r\n\r\n").mesh;
  EXPECT_EQ(mesh.point_count(), 3u);
  EXPECT_EQ(mesh.blocks[0].connectivity, (std::vector<uint32_t>{0, 1, 2}));
  EXPECT_EQ(read_obj("v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3").mesh.cell_count(), 1u);
}

TEST(ObjReader, NamesLinesItDoesNotKnow) {
  const ReadResult result = read_obj(square + "vp 1 2\ncurv 0 1 2\n");
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_EQ(result.notes[0], "2 lines left out that maille does not know, the first is line 5 (\"vp\")");
}

TEST(ObjReader, UsesDoublesWhereFloatsWouldLose) {
  const Mesh wide = read_obj("v 448262.15 0.1 2594140.20\nv 1 2 3\nvt 0.5 0.5\n").mesh;
  ASSERT_EQ(wide.points.type, Scalar::f64);
  EXPECT_EQ(wide.points.values<double>()[0], 448262.15);
  EXPECT_EQ(wide.points.values<double>()[1], 0.1);
  EXPECT_EQ(wide.find("texcoord", Domain::mesh)->type, Scalar::f32);
  const Mesh late = read_obj("v 1 2 3\nv 0.1 0 0\nv 0.10000000000000001 0 0\n").mesh;
  ASSERT_EQ(late.points.type, Scalar::f64);
  EXPECT_EQ(late.points.values<double>()[3], 0.1);
  EXPECT_EQ(read_obj("v 93.425102 -0.044779 1e-7\n").mesh.points.type, Scalar::f32);
}

TEST(ObjReader, NamesWhatIsWrong) {
  EXPECT_EQ(error_of(square + "f 1 2 9\n"), "test.obj: line 5: face 1: vertex 9 does not exist, there are 4");
  EXPECT_EQ(error_of(square + "f 1 2 3\nf 1 2 -5\n"),
            "test.obj: line 6: face 2: vertex -5 does not exist, there are 4");
  EXPECT_EQ(error_of(square + "f 0 1 2\n"), "test.obj: line 5: face 1: vertex 0; OBJ counts from 1");
  EXPECT_EQ(error_of(square + "f 1/1 2/1 3/1\n"),
            "test.obj: line 5: face 1: texture coordinate 1 does not exist, there are 0");
  EXPECT_EQ(error_of(square + "vn 0 0 1\nf 1//1 2//1 3//2\n"),
            "test.obj: line 6: face 1: normal 2 does not exist, there are 1");
  EXPECT_EQ(error_of(square + "f 1 2 3x\n"), "test.obj: line 5: face 1: \"x\" stands behind an index");
  EXPECT_EQ(error_of(square + "f 1 2 99999999999999999999\n").substr(0, 40),
            "test.obj: line 5: face 1: vertex 9999999");
  EXPECT_EQ(error_of(square + "f\n"), "test.obj: line 5: face 1 has no vertices");
  EXPECT_EQ(error_of("v 1 2\n"), "test.obj: line 1: vertex 1 has 2 numbers; there should be 3, 4, 6 or 7");
  EXPECT_EQ(error_of("v 1 2 3\nv 1 two 3\n"),
            "test.obj: line 2: vertex 2 has \"two\" where a number belongs");
  EXPECT_EQ(error_of("v 0 0 1e400\n"),
            "test.obj: line 1: vertex 1 has \"1e400\", which is too large for a double");
  EXPECT_EQ(error_of("vt\n"), "test.obj: line 1: texture coordinate 1 has 0 numbers; there should be 1 to 3");
  EXPECT_EQ(error_of("vn 1 2\n"), "test.obj: line 1: normal 1 has 2 numbers instead of 3");
}

constexpr const char* golden = R"(# made by hand
mtllib some file.mtl
v 0 0 0
v 1 0 0.1
v 1 1 -0
v 0 1 1e-10
vt 0 0
vt 1 0.25
vt 0.5 0.5
vn 0 0 1
vn 0 1 0
o house
g roof walls
usemtl tin
f 1/1/1 2/2/1 3/3/2
usemtl
f 1/1/1 3/3/1 4//1
s 1
f 1//2 2 3 4
l 1/1 2/2
p 3
)";

TEST(ObjWriter, RestoresAFile) {
  const Mesh mesh = read_obj(golden).mesh;
  EXPECT_EQ(write_text(obj_format(), mesh).text, golden);
}

TEST(ObjWriter, RestoresColours) {
  for (const char* text : {"v 0 0 0 1 0 0.5\nv 1 2 3 0 0 1\n", "v 0 0 0 0.25\nv 1 2 3\n",
                           "v 0 0 0 1 0 0 0.5\n", "v 0 0 0 1 1 1\nv 1 2 3\n"}) {
    EXPECT_EQ(write_text(obj_format(), read_obj(text).mesh).text, text);
  }
}

TEST(ObjWriter, GivesBackTheTypesOfNumbers) {
  Mesh mesh = read_obj(square + "f 1 2 3\n").mesh;
  mesh.points = array_of<double>("position", Domain::point, Scalar::f64, 3, {0, 0, 0, 0.1, 1, 1, 2, 2, 2});
  Array colour = make_array("colour", Domain::point, Scalar::u8, 4, Role::colour);
  for (int i = 0; i < 12; ++i) colour.bytes.push_back(static_cast<std::byte>(i * 23));
  mesh.arrays.push_back(colour);
  mesh.arrays.push_back(array_of<float>("texcoord", Domain::corner, Scalar::f32, 2, {0, 0, 1, 0, 1, 1},
                                        Role::texture_coordinate));
  const testing::Written written = write_text(obj_format(), mesh);
  EXPECT_TRUE(written.notes.empty());
  EXPECT_THAT(written.text, HasSubstr("# maille f64 position\n"));
  EXPECT_THAT(written.text, HasSubstr("# maille corners texcoord\n"));
  EXPECT_THAT(written.text, HasSubstr("# maille u8 colour\n"));
  const Mesh back = read_obj(written.text).mesh;
  expect_same_mesh(back, mesh);
}

TEST(ObjWriter, SaysWhatItLeavesOut) {
  Mesh mesh = read_obj(square + "f 1 2 3\n").mesh;
  mesh.arrays.push_back(array_of<float>("height", Domain::point, Scalar::f32, 1, {1, 2, 3, 4}));
  mesh.metadata.emplace_back("ply.order", "vertex face");
  mesh.metadata.emplace_back("units", "mm");
  const testing::Written written = write_text(obj_format(), mesh);
  EXPECT_EQ(written.notes,
            (std::vector<std::string>{"array \"height\" on points left out", "metadata \"units\" left out"}));
}

TEST(ObjReader, RejectsCutLines) {
  const std::string text = golden;
  for (size_t length = 0; length < text.size(); ++length) {
    // A text format cannot tell that whole lines are missing; what is left must still be a mesh or an error.
    const auto result = read_text(obj_format(), text.substr(0, length), "test.obj");
    if (!result) {
      EXPECT_EQ(result.error().code, ErrorCode::malformed_input);
    }
  }
}

/// What OBJ can hold comes back exactly, also from surfaces of every pathology.
RC_GTEST_PROP(ObjRoundTrip, IsExact, (uint64_t seed)) {
  testing::RandomMeshOptions options;
  options.several_blocks = false;
  options.any_position_type = false;
  options.degenerate_faces = false;
  options.special_values = false;
  options.arrays = false;
  Mesh mesh = testing::random_surface(seed, options);
  testing::Random random(seed);
  const auto add = [&](const char* name, Domain domain, uint32_t components, Role role) {
    testing::add_array(mesh, random, name, domain, components, role);
  };
  if (random.chance(50)) add("colour", Domain::point, random.between(3, 4), Role::colour);
  if (random.chance(70))
    add("texcoord", random.chance(70) ? Domain::corner : Domain::point, 2, Role::texture_coordinate);
  if (random.chance(50)) add("normal", random.chance(50) ? Domain::corner : Domain::point, 3, Role::normal);
  RC_ASSERT(testing::same_surface(read_obj(write_text(obj_format(), mesh).text).mesh, mesh));
}

}  // namespace
}  // namespace maille
