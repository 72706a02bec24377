#include "io/vrml/vrml.h"

#include <gtest/gtest.h>

#include "io/format.h"
#include "io/same_mesh.h"
#include "support/random.h"
#include "support/random_mesh.h"

namespace maille {
namespace {

using namespace maille::testing;
using List = std::vector<uint32_t>;

Result<ReadResult> read(std::string_view text) {
  return read_text(vrml_format(), text, "test.wrl");
}

Mesh mesh_of(const std::string& body) {
  auto result = read("#VRML V2.0 utf8\n" + body);
  EXPECT_TRUE(result) << result.error().message;
  return result ? std::move(result->mesh) : Mesh{};
}

std::string error_of(const std::string& body) {
  const auto result = read("#VRML V2.0 utf8\n" + body);
  return result ? "no error" : result.error().message;
}

/// Everything the reader must get through, with two faces at the end of it.
const char* const busy_scene = R"(#VRML V2.0 utf8
# a comment { [ "
WorldInfo { title "a \"quoted\" { title" info ["x", "y"] }
PROTO Thing [ field SFFloat size 1.0, eventIn SFBool on exposedField MFNode kids [] ] {
  Shape { geometry Box { size 1 1 1 } }
}
EXTERNPROTO Other [ field SFFloat a ] "urn:x"
DEF Top Group { children [
  Transform { translation 1 2,3 rotation 0 1 0 1.5 children
    Transform { scale 2 2 2 children [
      DEF Part Shape {
        appearance Appearance { material Material { diffuseColor 1 0 0 } texture ImageTexture { url "skin.png" } }
        geometry IndexedFaceSet {
          ccw TRUE solid FALSE creaseAngle 0.5
          coord DEF C Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0, .5 .5 +1e0 ] }
          coordIndex [ 0, 1, 2, 3, -1, 0 1 4 ]
        } }
    ] } }
  Script { url "javascript: function f() { return '}'; }" eventIn SFBool go field SFNode self USE Part directOutput TRUE }
  Thing { size 3 }
  Shape { geometry IndexedLineSet { coord USE C coordIndex [0 1 -1 2 3 4 -1] } }
  Shape { geometry PointSet { coord Coordinate { point [7 8 9 1 2 3] } } }
] }
ROUTE Top.a TO Part.b
)";

TEST(VrmlWriter, KeepsColoursOfPointsWithoutCells) {
  Mesh mesh;
  mesh.points = array_of<float>("position", Domain::point, Scalar::f32, 3, {0, 0, 0, 1, 0, 0, 2, 0, 0});
  mesh.arrays.push_back(make_array("colour", Domain::cell, Scalar::f32, 3, Role::colour));
  mesh.arrays.push_back(array_of<uint8_t>("colour", Domain::point, Scalar::u8, 3,
                                          {255, 0, 0, 0, 255, 0, 0, 0, 255}, Role::colour));
  const auto back = read(write_text(vrml_format(), mesh).text);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_TRUE(back->mesh.points.bytes == mesh.points.bytes);
  const Array* colour = back->mesh.find("colour", Domain::point);
  ASSERT_NE(colour, nullptr);
  expect_same_array(*colour, array_of<float>("colour", Domain::point, Scalar::f32, 3,
                                             {1, 0, 0, 0, 1, 0, 0, 0, 1}, Role::colour));
}

TEST(VrmlReader, FindsGeometryAtAnyDepth) {
  const auto result = read(busy_scene);
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  ASSERT_EQ(mesh.blocks.size(), 3u);
  EXPECT_EQ(mesh.blocks[0].name, "Part");
  EXPECT_EQ(mesh.blocks[0].type, CellType::polygon);
  EXPECT_EQ(mesh.blocks[0].offsets, (std::vector<uint64_t>{0, 4, 7}));
  EXPECT_EQ(mesh.blocks[0].connectivity, (List{0, 1, 2, 3, 0, 1, 4}));
  EXPECT_EQ(mesh.blocks[1].type, CellType::poly_line);
  EXPECT_EQ(mesh.blocks[1].connectivity, (List{0, 1, 2, 3, 4}));
  EXPECT_EQ(mesh.blocks[2].type, CellType::vertex);
  EXPECT_EQ(mesh.blocks[2].connectivity, (List{5, 6}));
  EXPECT_EQ(mesh.point_count(), 7u);
  EXPECT_EQ(mesh.points.type, Scalar::f32);
  EXPECT_EQ(mesh.points.values<float>()[14], 1.f);
}

TEST(VrmlReader, KeepsTransformsAndSaysWhatIsLeftOut) {
  const auto result = read(busy_scene);
  ASSERT_TRUE(result) << result.error().message;
  using Pair = std::pair<std::string, std::string>;
  EXPECT_EQ(result->mesh.metadata,
            (std::vector<Pair>{Pair("vrml.transform.0", "translation 1 2 3 rotation 0 1 0 1.5 / scale 2 2 2"),
                               Pair("vrml.texture", "skin.png")}));
  EXPECT_TRUE(has_note(result->notes, "1 Box node left out"));
  EXPECT_TRUE(has_note(result->notes, "1 repetition of geometry"));
  EXPECT_TRUE(has_note(result->notes, "transforms are not applied"));
  EXPECT_TRUE(has_note(result->notes, "materials"));
}

constexpr const char* square =
    "coord Coordinate { point [0 0 0 1 0 0 1 1 0 0 1 0] } coordIndex [0 1 2 -1 0 2 3 -1] ";

std::string faces(const std::string& more) {
  return "Shape { geometry IndexedFaceSet { " + (square + more) + " } }";
}

template <class T>
std::vector<T> values(const Mesh& mesh, const std::string& name, Domain domain) {
  const Array* array = mesh.find(name, domain);
  EXPECT_TRUE(array) << name;
  if (!array) return {};
  return {array->values<T>().begin(), array->values<T>().end()};
}

TEST(VrmlReader, AttributesGoToPointsCornersOrCells) {
  const Mesh points = mesh_of(faces("color Color { color [1 0 0 0 1 0 0 0 1 .5 .5 .5] }"));
  EXPECT_EQ(values<float>(points, "colour", Domain::point),
            (std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 1, .5f, .5f, .5f}));
  EXPECT_EQ(points.arrays[0].role, Role::colour);

  const Mesh corners =
      mesh_of(faces("texCoord TextureCoordinate { point [0 0 1 0 1 1] } texCoordIndex [0 1 2 -1 2 1 0]"));
  EXPECT_EQ(values<float>(corners, "texcoord", Domain::corner),
            (std::vector<float>{0, 0, 1, 0, 1, 1, 1, 1, 1, 0, 0, 0}));

  const Mesh follows = mesh_of(
      faces("texCoord TextureCoordinate { point [0 0 1 0 1 1 0 1] } texCoordIndex [0 1 2 -1 0 2 3 -1]"));
  EXPECT_TRUE(follows.find("texcoord", Domain::point));

  const Mesh cells =
      mesh_of(faces("normal Normal { vector [0 0 1 0 0 -1] } normalPerVertex FALSE normalIndex [1 0]"));
  EXPECT_EQ(values<float>(cells, "normal", Domain::cell), (std::vector<float>{0, 0, -1, 0, 0, 1}));
  const Mesh in_order = mesh_of(faces("colorPerVertex FALSE color Color { color [0 0 1 0 1 0] }"));
  EXPECT_EQ(values<float>(in_order, "colour", Domain::cell), (std::vector<float>{0, 0, 1, 0, 1, 0}));
}

TEST(VrmlReader, SharedPointsWithOtherColoursBecomeCorners) {
  const Mesh mesh = mesh_of(
      "Shape { geometry IndexedFaceSet { coord DEF P Coordinate { point [0 0 0 1 0 0 1 1 0] } coordIndex [0 "
      "1 2] "
      "color Color { color [0 0 0 0 0 0 0 0 0] } } }"
      "Shape { geometry IndexedFaceSet { coord USE P coordIndex [2 1 0] color Color { color [1 0 0 0 1 0 0 0 "
      "1] } } }");
  EXPECT_EQ(mesh.point_count(), 3u);
  EXPECT_EQ(values<float>(mesh, "colour", Domain::point), std::vector<float>(9, 0));
  EXPECT_EQ(values<float>(mesh, "colour", Domain::corner),
            (std::vector<float>{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 1, 0, 0}));
}

TEST(VrmlReader, SaysThatSomeGeometriesHaveNoColoursHoweverOftenOthersShareTheirs) {
  const std::string shared = "Shape { geometry PointSet { coord USE P color USE C } }";
  const auto result = read(
      "#VRML V2.0 utf8\n"
      "Shape { geometry PointSet { coord DEF P Coordinate { point [0 0 0 1 0 0] } "
      "color DEF C Color { color [1 0 0 0 1 0] } } }" +
      shared + shared + "Shape { geometry PointSet { coord Coordinate { point [5 0 0 6 0 0] } } }");
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(values<float>(result->mesh, "colour", Domain::point),
            (std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_TRUE(has_note(result->notes, "belongs to some of the geometries only"));
}

TEST(VrmlReader, NumbersThatNeedDoublesAreKept) {
  const Mesh mesh = mesh_of(
      "Shape { geometry PointSet { coord Coordinate { point [0.1 0 0] } } }"
      "Shape { geometry PointSet { coord Coordinate { point [2594140.25891 0 1e-300] } color Color { color "
      "[0.1 0 0] } } }");
  ASSERT_EQ(mesh.points.type, Scalar::f64);
  EXPECT_EQ(mesh.points.values<double>()[0], 0.1);
  EXPECT_EQ(mesh.points.values<double>()[3], 2594140.25891);
  EXPECT_EQ(mesh.find("colour", Domain::point)->type, Scalar::f32);
}

TEST(VrmlReader, RepetitionCannotExplode) {
  std::string text = "DEF A0 Group { children [ " + faces("") + " ] }\n";
  for (int i = 1; i < 60; ++i) {
    const std::string before = "USE A" + std::to_string(i - 1);
    text += "DEF A" + std::to_string(i) + " Group { children [ " + before + " " + before + " ] }\n";
  }
  EXPECT_EQ(mesh_of(text).cell_count(), 2u);
}

TEST(VrmlReader, NamesWhatIsWrong) {
  const auto expect = [](const std::string& body, const std::string& message) {
    const std::string error = error_of(body);
    EXPECT_EQ(error.find("test.wrl: line "), 0u) << error;
    EXPECT_NE(error.find(message), std::string::npos) << error;
  };
  const std::string head =
      "Shape {\n geometry IndexedFaceSet { coord Coordinate { point [0 0 0 1 0 0 0 1 0] } ";
  expect(head + "coordIndex [0 1 3] } }",
         "line 3: the geometry that begins here: coordIndex has 3, but there are 3");
  expect(head + "coordIndex [0 1 -2] } }", "coordIndex has -2");
  expect(head + "coordIndex [0 1 x] } }", "line 3: found \"x]\" in a list of numbers");
  expect(head + "coordIndex [0 1 99999999999] } }", "out of range");
  expect(head + "coordIndex [0 1 2]", "the file ends inside brackets that open in line 3");
  expect(head + "coordIndex [0 1 2] ] }", "a \"]\" that closes nothing");
  expect(head + "coordIndex [0 1 2] color Color { color [1 1 1] } colorIndex [0 1 0] } }",
         "needs entry 1 of 1");
  expect(head + "coordIndex [0 1 2] color Color { color [1 1 1] } colorIndex [0 0] } }", "same faces");
  expect("Shape { geometry PointSet { coord Coordinate { point [0 0] } } }",
         "no whole number of tuples of 3");
  expect("Group { children USE Nobody }", "USE of \"Nobody\"");
  expect("Shape { geometry IndexedFaceSet { coordIndex [0 1 2] } }", "no coordinates");
  expect("WorldInfo { title \"abc }", "a string begins here");
  expect(std::string(300, '['), "200 levels");
}

TEST(VrmlReader, OtherVersionsAreRefusedByName) {
  const auto old = read("#VRML V1.0 ascii\nSeparator { }");
  ASSERT_FALSE(old);
  EXPECT_EQ(old.error().code, ErrorCode::unsupported);
  EXPECT_NE(old.error().message.find("VRML 1.0"), std::string::npos);
  EXPECT_EQ(read("#X3D V3.0 utf8\n").error().code, ErrorCode::unsupported);
  EXPECT_EQ(read("solid\n").error().code, ErrorCode::malformed_input);
}

TEST(VrmlReader, TruncationsInsideOfNodesAreErrors) {
  const std::string text =
      "#VRML V2.0 utf8\n" + faces("color Color { color [1 0 0 0 1 0 0 0 1 0 0 0] } solid FALSE");
  for (size_t size = 17; size < text.size(); ++size) EXPECT_FALSE(read(text.substr(0, size))) << size;
}

TEST(VrmlReader, RandomDamageIsAnErrorOrAValidMesh) {
  const std::string files[] = {
      busy_scene, "#VRML V2.0 utf8\n" + faces("color Color { color [1 0 0 0 1 0 0 0 1 0 0 0] } "
                                              "colorIndex [3 2 1 -1 0 0 0 -1] normalPerVertex FALSE "
                                              "normal Normal { vector [0 0 1 1 0 0] }")};
  Random random(11);
  for (int trial = 0; trial < 6000; ++trial) {
    std::string text = files[trial % 2];
    for (uint32_t i = random.between(1, 4); i > 0; --i) {
      const size_t at = 16 + random.below(text.size() - 16);
      if (random.chance(30)) {
        text.erase(at, random.between(1, 30));
      } else {
        text[at] = random.chance(50) ? "0123456789-{}[]\"#,"[random.below(18)]
                                     : static_cast<char>(random.below(256));
      }
      if (text.size() < 32) break;
    }
    read(text);
  }
}

TEST(VrmlWriter, IsTheInverseOfTheReader) {
  Mesh mesh;
  mesh.points = array_of<float>("position", Domain::point, Scalar::f32, 3,
                                {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0.1f, 5, 5, -0.f});
  mesh.blocks.push_back({"a", CellType::quad, {}, {}, {0, 1, 2, 3}});
  mesh.blocks.push_back({"", CellType::polygon, {}, {0, 3, 3, 8}, {0, 1, 2, 4, 3, 2, 1, 0}});
  mesh.arrays.push_back(
      array_of<float>("normal", Domain::point, Scalar::f32, 3, std::vector<float>(15, 0.3f), Role::normal));
  mesh.arrays.push_back(
      array_of<float>("colour", Domain::cell, Scalar::f32, 3, std::vector<float>(12, 0.7f), Role::colour));
  std::vector<float> uv;
  for (int i = 0; i < 24; ++i) uv.push_back(static_cast<float>(i) / 7);
  mesh.arrays.push_back(
      array_of<float>("texcoord", Domain::corner, Scalar::f32, 2, uv, Role::texture_coordinate));
  mesh.metadata = {{"vrml.transform.1", "translation 1 2 3 / scale 2 2 2"}};
  const Written written = write_text(vrml_format(), mesh);
  EXPECT_TRUE(written.notes.empty()) << written.notes[0];
  const auto back = read(written.text);
  ASSERT_TRUE(back) << back.error().message;
  expect_same_mesh(back->mesh, mesh);
}

TEST(VrmlWriter, SaysWhatItCannotHold) {
  Mesh mesh;
  mesh.points =
      array_of<double>("position", Domain::point, Scalar::f64, 3, {0, 0, 0, 1.0 / 3, 0, 0, 1, 1, 0});
  mesh.blocks.push_back({"a b", CellType::vertex, {}, {}, {2}});
  mesh.arrays.push_back(array_of<uint8_t>("rgb", Domain::point, Scalar::u8, 4,
                                          {255, 0, 51, 255, 0, 0, 0, 0, 1, 2, 255, 4}, Role::colour));
  mesh.arrays.push_back(array_of<float>("p", Domain::cell, Scalar::f32, 1, {1}));
  const Written written = write_text(vrml_format(), mesh);
  for (const char* part : {"\"rgb\" is divided", "no alpha", "array \"p\"", "single precision",
                           "1 point written again", "1 block name changed"}) {
    EXPECT_TRUE(has_note(written.notes, part)) << part;
  }
  const auto back = read(written.text);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->mesh.blocks[0].name, "a_b");
  EXPECT_EQ(back->mesh.find("colour", Domain::point)->values<float>()[2], 1.f);
}

TEST(VrmlWriter, RandomFacesComeBack) {
  RandomMeshOptions options;
  options.any_position_type = false;
  options.special_values = false;
  options.arrays = false;
  for (uint64_t seed = 0; seed < 200; ++seed) {
    const Mesh mesh = random_surface(seed, options);
    if (mesh.cell_count() == 0) continue;  // points alone come back as cells of one point
    const auto back = read(write_text(vrml_format(), mesh).text);
    ASSERT_TRUE(back) << seed << ": " << back.error().message;
    List before, after;
    for (const CellBlock& block : mesh.blocks)
      before.insert(before.end(), block.connectivity.begin(), block.connectivity.end());
    for (const CellBlock& block : back->mesh.blocks)
      after.insert(after.end(), block.connectivity.begin(), block.connectivity.end());
    EXPECT_EQ(after, before) << seed;
    EXPECT_EQ(back->mesh.cell_count(), mesh.cell_count()) << seed;
    EXPECT_TRUE(back->mesh.points.bytes == mesh.points.bytes) << seed;
  }
}

}  // namespace
}  // namespace maille
