#include <gmock/gmock.h>
#include <maille/compare.h>
#include <rapidcheck/gtest.h>

#include "base/bytes.h"
#include "io/ply/ply.h"
#include "io/same_mesh.h"
#include "support/random.h"
#include "support/random_mesh.h"

namespace maille {
namespace {

using testing::array_of;
using testing::expect_same_mesh;
using ::testing::HasSubstr;
using testing::read_text;
using testing::values_of;
using testing::write_text;

ReadResult read_ply(std::string_view text) {
  return testing::read_good_text(ply_format(), text, "test.ply");
}

std::string error_of(std::string_view text) {
  return testing::error_of_text(ply_format(), text, "test.ply");
}

std::string one_vertex(const std::string& type, const std::string& x) {
  return "ply\nformat ascii 1.0\nelement vertex 1\nproperty " + type + " x\nproperty " + type +
         " y\nproperty " + type + " z\nend_header\n" + x + " 0 0\n";
}

TEST(PlyReader, RefusesNumbersBeyondTheirType) {
  EXPECT_EQ(
      error_of(one_vertex("float", "1e39")),
      "test.ply: line 8: vertex 0: property \"x\" has \"1e39\", which is too large for a float; declare "
      "the property as double");
  EXPECT_EQ(error_of(one_vertex("float", "-1e400")),
            "test.ply: line 8: vertex 0: property \"x\" has \"-1e400\", which is too large for a double");
  EXPECT_EQ(error_of(one_vertex("double", "1e400")),
            "test.ply: line 8: vertex 0: property \"x\" has \"1e400\", which is too large for a double");
  EXPECT_EQ(read_ply(one_vertex("double", "1e39")).mesh.points.values<double>()[0], 1e39);
  for (const char* text : {"inf", "-inf", "3.4028235e38"}) {
    EXPECT_TRUE(read_ply(one_vertex("float", text)).notes.empty()) << text;
  }
}

TEST(PlyReader, NotesNumbersTooSmallForAFloat) {
  const std::vector<std::string> note = {
      "1 number too small for the float that the header declares: zero, or with fewer digits"};
  const ReadResult zero = read_ply(one_vertex("float", "1e-50"));
  EXPECT_EQ(zero.mesh.points.values<float>()[0], 0);
  EXPECT_EQ(zero.notes, note);
  EXPECT_EQ(read_ply(one_vertex("float", "1.23456789e-42")).notes, note);
  for (const char* text : {"1e-45", "0", "-0.0", "1.4e-45", "1.2e-38"}) {
    EXPECT_TRUE(read_ply(one_vertex("float", text)).notes.empty()) << text;
  }
  EXPECT_TRUE(read_ply(one_vertex("double", "1e-50")).notes.empty());
}

/// Everything PLY has in one small file.
constexpr const char* everything = R"(ply
format ascii 1.0
comment made by hand
obj_info scanned  twice
comment
element camera 2
property float view_px
property list uchar short path
element vertex 5
property double x
property double y
property double z
property float nx
property float ny
property float nz
property uchar red
property uchar green
property uchar blue
property uchar alpha
property float u
property float v
property int flags
property list uchar uint bones
element face 3
property list uchar int vertex_index
property list uchar float texcoord
property uchar red
property uchar green
property uchar blue
property short quality
element edge 1
property int vertex1
property int vertex2
property short quality
property float crease
element empty 0
property double nothing
end_header
1.5 2 10 -11
2.5 0
0 0 0.1 0 0 1 255 0 0 128 0 0 -7 1 4000000000
1 0 0 0 0 1 0 255 0 128 1 0 8 2 1 2
1 1 0 0 0 1 0 0 255 128 1 1 9 0
0 1 -0 0 0 1 1 2 3 4 0 1 10 1 9
5 5 1e+300 0 0 1 1 2 3 4 0.5 nan 11 2 7 8
3 0 1 2 6 0 0 1 0 1 1 10 20 30 -5
4 0 1 2 3 8 0 0 1 0 1 1 0 1 11 21 31 -6
3 2 3 4 6 1 1 0 1 0.5 0.5 12 22 32 -7
1 4 77 0.25
)";

TEST(PlyReader, KeepsPositionsAsDoubles) {
  const Mesh mesh = read_ply(everything).mesh;
  ASSERT_EQ(mesh.points.type, Scalar::f64);
  ASSERT_EQ(mesh.point_count(), 5u);
  EXPECT_EQ(mesh.points.values<double>()[2], 0.1);
  EXPECT_EQ(mesh.points.values<double>()[14], 1e300);
  EXPECT_TRUE(std::signbit(mesh.points.values<double>()[11]));
}

TEST(PlyReader, GroupsTheUsualProperties) {
  const Mesh mesh = read_ply(everything).mesh;
  const Array* normal = mesh.find("normal", Domain::point);
  const Array* colour = mesh.find("colour", Domain::point);
  const Array* texcoord = mesh.find("texcoord", Domain::point);
  ASSERT_TRUE(normal && colour && texcoord);
  EXPECT_EQ(normal->components, 3u);
  EXPECT_EQ(normal->role, Role::normal);
  EXPECT_EQ(colour->components, 4u);
  EXPECT_EQ(colour->type, Scalar::u8);
  EXPECT_EQ(colour->role, Role::colour);
  EXPECT_EQ(colour->values<uint8_t>()[3], 128);
  EXPECT_EQ(texcoord->components, 2u);
  EXPECT_EQ(texcoord->role, Role::texture_coordinate);
  EXPECT_EQ(values_of<int32_t>(mesh, "flags", Domain::point), (std::vector<int32_t>{-7, 8, 9, 10, 11}));
}

TEST(PlyReader, KeepsMixedDegrees) {
  const Mesh mesh = read_ply(everything).mesh;
  ASSERT_EQ(mesh.blocks.size(), 2u);
  EXPECT_EQ(mesh.blocks[0].type, CellType::polygon);
  EXPECT_EQ(mesh.blocks[0].offsets, (std::vector<uint64_t>{0, 3, 7, 10}));
  EXPECT_EQ(mesh.blocks[0].connectivity, (std::vector<uint32_t>{0, 1, 2, 0, 1, 2, 3, 2, 3, 4}));
  EXPECT_EQ(mesh.blocks[1].type, CellType::line);
  EXPECT_EQ(mesh.blocks[1].connectivity, (std::vector<uint32_t>{1, 4}));
}

TEST(PlyReader, PutsTextureCoordinatesOnCorners) {
  const Mesh mesh = read_ply(everything).mesh;
  const Array* texcoord = mesh.find("texcoord", Domain::corner);
  ASSERT_TRUE(texcoord);
  EXPECT_EQ(texcoord->role, Role::texture_coordinate);
  ASSERT_EQ(texcoord->count(), 12u);
  EXPECT_EQ(texcoord->values<float>()[19], 0.5f);
  EXPECT_EQ(texcoord->values<float>()[20], 0);  // the edge's corners have none
}

TEST(PlyReader, KeepsListsOfVaryingLength) {
  const Mesh mesh = read_ply(everything).mesh;
  EXPECT_EQ(values_of<uint8_t>(mesh, "bones.count", Domain::point), (std::vector<uint8_t>{1, 2, 0, 1, 2}));
  EXPECT_EQ(values_of<uint32_t>(mesh, "bones", Domain::point),
            (std::vector<uint32_t>{4000000000, 0, 1, 2, 0, 0, 9, 0, 7, 8}));
}

TEST(PlyReader, KeepsListsOfOneLengthAsComponents) {
  const Mesh mesh =
      read_ply(
          "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
          "property float z\nproperty list int short w\nend_header\n0 0 0 3 1 2 3\n1 1 1 3 4 5 6\n")
          .mesh;
  const Array* array = mesh.find("w", Domain::point);
  ASSERT_TRUE(array);
  EXPECT_EQ(array->components, 3u);
  EXPECT_EQ(values_of<int16_t>(mesh, "w", Domain::point), (std::vector<int16_t>{1, 2, 3, 4, 5, 6}));
}

TEST(PlyReader, KeepsListsTooVariedToPadOnTheMesh) {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 101\nproperty float x\nproperty float y\nproperty float z\n"
      "property list int int w\nend_header\n0 0 0 200";
  for (int i = 0; i < 200; ++i) text += " " + std::to_string(i);
  text += "\n";
  for (int i = 0; i < 100; ++i) text += "1 1 1 1 7\n";
  const ReadResult result = read_ply(text);
  EXPECT_EQ(values_of<int32_t>(result.mesh, "w.count", Domain::point)[0], 200);
  EXPECT_EQ(values_of<int32_t>(result.mesh, "w", Domain::mesh).size(), 300u);
  EXPECT_FALSE(result.notes.empty());
  WriteOptions options;
  options.ascii = true;
  const std::string written = write_text(ply_format(), result.mesh, options).text;
  EXPECT_EQ(written, text);
}

TEST(PlyReader, KeepsUnknownElements) {
  const Mesh mesh = read_ply(everything).mesh;
  EXPECT_EQ(values_of<float>(mesh, "camera.view_px", Domain::mesh), (std::vector<float>{1.5f, 2.5f}));
  EXPECT_EQ(values_of<uint8_t>(mesh, "camera.path.count", Domain::mesh), (std::vector<uint8_t>{2, 0}));
  EXPECT_EQ(values_of<int16_t>(mesh, "camera.path", Domain::mesh), (std::vector<int16_t>{10, -11}));
  ASSERT_TRUE(mesh.find("empty.nothing", Domain::mesh));
}

TEST(PlyReader, KeepsCommentsInOrder) {
  const Mesh mesh = read_ply(everything).mesh;
  ASSERT_GE(mesh.metadata.size(), 3u);
  EXPECT_EQ(mesh.metadata[0], (std::pair<std::string, std::string>("comment", "made by hand")));
  EXPECT_EQ(mesh.metadata[1], (std::pair<std::string, std::string>("obj_info", "scanned  twice")));
  EXPECT_EQ(mesh.metadata[2], (std::pair<std::string, std::string>("comment", "")));
}

// Files of assimp's test models have such lines. Behind an element they might be misspelt properties.
TEST(PlyReader, TakesLinesWithoutKeywordBeforeTheFirstElementAsComments) {
  const std::string head = "ply\nformat ascii 1.0\n";
  const std::string tail =
      "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";
  const Mesh mesh = read_ply(head + "made by hand\n" + tail).mesh;
  EXPECT_EQ(mesh.point_count(), 1u);
  ASSERT_EQ(mesh.metadata.size(), 1u);
  EXPECT_EQ(mesh.metadata[0].second, "made by hand");
}

TEST(PlyReader, SharesArraysOfFacesAndEdges) {
  const Mesh mesh = read_ply(everything).mesh;
  EXPECT_EQ(values_of<int16_t>(mesh, "quality", Domain::cell), (std::vector<int16_t>{-5, -6, -7, 77}));
  EXPECT_EQ(values_of<float>(mesh, "crease", Domain::cell), (std::vector<float>{0, 0, 0, 0.25f}));
  EXPECT_EQ(values_of<uint8_t>(mesh, "colour", Domain::cell),
            (std::vector<uint8_t>{10, 20, 30, 11, 21, 31, 12, 22, 32, 0, 0, 0}));
}

TEST(PlyWriter, RestoresEverythingOfAFile) {
  const ReadResult read = read_ply(everything);
  WriteOptions options;
  options.ascii = true;
  const testing::Written written = write_text(ply_format(), read.mesh, options);
  EXPECT_TRUE(written.notes.empty()) << written.notes.front();
  EXPECT_EQ(written.text, everything);
}

TEST(PlyWriter, RestoresEverythingInBinary) {
  const ReadResult read = read_ply(everything);
  for (const bool big_endian : {false, true}) {
    WriteOptions options;
    options.big_endian = big_endian;
    const std::string binary = write_text(ply_format(), read.mesh, options).text;
    EXPECT_THAT(binary, HasSubstr(big_endian ? "binary_big_endian" : "binary_little_endian"));
    expect_same_mesh(read.mesh, read_ply(binary).mesh);
  }
}

TEST(PlyReader, ReadsGoldenBinary) {
  const std::string header =
      "element vertex 3\nproperty short x\nproperty short y\nproperty short z\n"
      "element face 1\nproperty list ushort uchar vertex_indices\nproperty double d\nend_header\n";
  // Vertices (1, 2, 3), (-1, 0, 256), (0, 0, 0); a face of 3: 0 1 2, d = 1.
  const std::string little("\1\0\2\0\3\0\377\377\0\0\0\1\0\0\0\0\0\0\3\0\0\1\2\0\0\0\0\0\0\360\77", 31);
  const std::string big("\0\1\0\2\0\3\377\377\0\0\1\0\0\0\0\0\0\0\0\3\0\1\2\77\360\0\0\0\0\0\0", 31);
  const Mesh a = read_ply("ply\nformat binary_little_endian 1.0\n" + header + little).mesh;
  const Mesh b = read_ply("ply\nformat binary_big_endian 1.0\n" + header + big).mesh;
  expect_same_mesh(a, b);
  EXPECT_EQ(a.points.type, Scalar::i16);
  EXPECT_EQ(std::vector<int16_t>(a.points.values<int16_t>().begin(), a.points.values<int16_t>().end()),
            (std::vector<int16_t>{1, 2, 3, -1, 0, 256, 0, 0, 0}));
  EXPECT_EQ(a.blocks[0].type, CellType::triangle);
  EXPECT_EQ(values_of<double>(a, "d", Domain::cell), std::vector<double>{1});
  // The types of the list come back too.
  EXPECT_THAT(write_text(ply_format(), a).text, HasSubstr("property list ushort uchar vertex_indices"));
}

TEST(PlyReader, TurnsStripsIntoTriangles) {
  const ReadResult result = read_ply(
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n2 0 0\n3 0 0\n4 0 0\n5 0 0\n"
      "11 0 1 2 3 3 4 -1 3 4 5 0\n");
  ASSERT_EQ(result.mesh.blocks.size(), 1u);
  EXPECT_EQ(result.mesh.blocks[0].type, CellType::triangle);
  EXPECT_EQ(result.mesh.blocks[0].connectivity, (std::vector<uint32_t>{0, 1, 2, 2, 1, 3, 3, 4, 5, 5, 4, 0}));
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_THAT(result.notes[0], HasSubstr("4 triangles"));
  EXPECT_THAT(result.notes[0], HasSubstr("2 triangles without area"));
}

TEST(PlyReader, TakesLineEndsOfEverySystem) {
  const std::string unix_text =
      "ply\nformat ascii 1.0\ncomment x\nelement vertex 1\nproperty float x\nproperty float y\nproperty "
      "float z\n"
      "end_header\n1 2 3\n";
  const Mesh expected = read_ply(unix_text).mesh;
  for (const std::string end : {"\r\n", "\r"}) {
    std::string text;
    for (const char c : unix_text) text += c == '\n' ? end : std::string(1, c);
    expect_same_mesh(read_ply(text).mesh, expected);
  }
}

TEST(PlyReader, TakesBinaryDataThatBeginsLikeALineEnd) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string text;
    for (const char c :
         std::string("ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\n"
                     "property uchar y\nproperty uchar z\nend_header\n")) {
      text += c == '\n' ? end : std::string(1, c);
    }
    const Mesh mesh = read_ply(text + "\n\r\n").mesh;
    ASSERT_EQ(mesh.point_count(), 1u);
    EXPECT_EQ(mesh.points.values<uint8_t>()[0], '\n');
    EXPECT_EQ(mesh.points.values<uint8_t>()[1], '\r');
  }
}

TEST(PlyReader, MakesDoublesOfMixedPositions) {
  const ReadResult result = read_ply(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty int y\nproperty double "
      "z\nend_header\n"
      "0.1 7 0.1\n");
  ASSERT_EQ(result.mesh.points.type, Scalar::f64);
  EXPECT_EQ(result.mesh.points.values<double>()[0], static_cast<double>(0.1f));
  EXPECT_EQ(result.mesh.points.values<double>()[1], 7);
  EXPECT_EQ(result.mesh.points.values<double>()[2], 0.1);
  EXPECT_EQ(result.notes.size(), 1u);
}

TEST(PlyReader, TakesWholeNumbersWrittenAsFloats) {
  const Mesh mesh = read_ply(
                        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                        "property float z\nproperty uchar red\nend_header\n0 0 0 255.0\n")
                        .mesh;
  EXPECT_EQ(values_of<uint8_t>(mesh, "red", Domain::point), std::vector<uint8_t>{255});
}

TEST(PlyReader, KeepsPropertiesThatDoNotMakeAGroup) {
  const Mesh mesh = read_ply(
                        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                        "property float z\nproperty float nx\nproperty double ny\nproperty float nz\n"
                        "property float red\nproperty float s\nproperty float u\nproperty float v\n"
                        "end_header\n0 0 0 1 2 3 4 5 6 7\n")
                        .mesh;
  for (const char* name : {"nx", "nz", "red", "s"}) EXPECT_TRUE(mesh.find(name, Domain::point)) << name;
  EXPECT_EQ(values_of<double>(mesh, "ny", Domain::point), std::vector<double>{2});
  EXPECT_EQ(values_of<float>(mesh, "texcoord", Domain::point), (std::vector<float>{6, 7}));
}

TEST(PlyReader, NamesWhatIsWrong) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string faces = head + "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string points = "0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(error_of(faces + points + "3 0 1 2\n3 0 1 3\n"),
            "test.ply: line 14: face 1: vertex 3 does not exist, there are 3");
  EXPECT_EQ(error_of(faces + points + "3 0 1 2\n3 0 1 -1\n"),
            "test.ply: line 14: face 1: vertex -1 does not exist, there are 3");
  EXPECT_EQ(
      error_of(faces + points + "3 0 1 2\n3 0 x 1\n"),
      "test.ply: line 14: face 1: property \"vertex_indices\" has \"x\" where a number of type int belongs");
  EXPECT_EQ(error_of(faces + "0 0 0\n1 zero 0\n"),
            "test.ply: line 11: vertex 1: property \"y\" has \"zero\" where a number belongs");
  EXPECT_EQ(error_of(faces + points + "3 0 1 2\n"), "test.ply: line 14: the file ends at face 1 of 2");
  EXPECT_EQ(error_of(faces + "0 0 0 7\n"),
            "test.ply: line 10: vertex 0: \"7\" stands behind the 3 properties the header declares");
  EXPECT_EQ(error_of(head + "property short x\n"),
            "test.ply: line 7: a second property \"x\" in element \"vertex\"");
  EXPECT_EQ(error_of(head + "element vertex 1\n"), "test.ply: line 7: a second element \"vertex\"");
  EXPECT_EQ(error_of(head + "property strange a\n"), "test.ply: line 7: unknown type \"strange\"");
  EXPECT_EQ(error_of(head + "property list float int a\n"),
            "test.ply: line 7: the length of a list must be an integer");
  EXPECT_EQ(error_of(head + "nonsense\n"), "test.ply: line 7: unknown keyword \"nonsense\" in the header");
  EXPECT_EQ(error_of("ply\nproperty int a\n"), "test.ply: line 2: a property before the first element");
  EXPECT_EQ(error_of("ply\nformat ascii 2.0\n"), "test.ply: line 2: PLY version \"2.0\" instead of 1.0");
  EXPECT_EQ(error_of("ply\nelement vertex -1\n"),
            "test.ply: line 2: element \"vertex\" has \"-1\" where its count belongs");
  EXPECT_EQ(error_of("ply\nend_header\n"), "test.ply: line 3: the header has no line \"format\"");
  EXPECT_EQ(error_of("plywood"), "test.ply: line 1: a PLY file begins with the line \"ply\"");
  EXPECT_THAT(error_of("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
              HasSubstr("element vertex has no property \"y\""));
}

TEST(PlyReader, NamesTheByteInBinaryFiles) {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\n"
      "property uchar z\nelement face 2\nproperty list char int vertex_indices\nend_header\n";
  const std::string point(3, '\0');
  const std::string face("\1\0\0\0\0", 5);
  const auto at = [&](size_t offset) { return "test.ply: byte " + std::to_string(header.size() + offset); };
  EXPECT_EQ(error_of(header + point + face), at(8) +
                                                 ": the file ends inside face 1 of 2, which begins at byte " +
                                                 std::to_string(header.size() + 8));
  EXPECT_EQ(error_of(header + point + face + std::string("\1\1\0\0\0", 5)),
            at(9) + ": face 1: vertex 1 does not exist, there are 1");
  EXPECT_EQ(error_of(header + point + face + "\377"),
            at(8) + ": face 1: list \"vertex_indices\" has the length -1");
}

TEST(PlyReader, RejectsEveryTruncation) {
  const Mesh mesh = read_ply(everything).mesh;
  for (const bool ascii : {false, true}) {
    WriteOptions options;
    options.ascii = ascii;
    const std::string text = write_text(ply_format(), mesh, options).text;
    // In text, a number cut short is still a number; only its last digit and the line end can be missing.
    const size_t whole = ascii ? text.rfind(' ') + 2 : text.size();
    for (size_t length = 0; length < whole; ++length) {
      const auto result = read_text(ply_format(), text.substr(0, length), "test.ply");
      ASSERT_FALSE(result) << ascii << " " << length;
      EXPECT_EQ(result.error().code, ErrorCode::malformed_input);
      EXPECT_THAT(result.error().message, HasSubstr("test.ply"));
    }
  }
}

TEST(PlyReader, SaysWhatStandsBehindTheEnd) {
  const ReadResult result = read_ply(std::string(everything) + "one more line\n");
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_THAT(result.notes[0], HasSubstr("14 bytes behind the last element"));
}

TEST(PlyWriter, WritesArraysOfAnyNameAndType) {
  Mesh mesh = read_ply(everything).mesh;
  const uint64_t points = mesh.point_count();
  for (unsigned t = 0; t < scalar_count; ++t) {
    for (const Domain domain : {Domain::point, Domain::cell, Domain::corner, Domain::mesh}) {
      const auto type = static_cast<Scalar>(t);
      Array array = make_array(std::string("an array, ") + name_of(type) + " \xc3\xa4%", domain, type,
                               1 + t % 4, static_cast<Role>(t % role_count));
      array.resize(domain == Domain::mesh ? 3 : mesh.count_of(domain));
      testing::Random random(t);
      // Whole bytes that are no NaN in any type.
      for (std::byte& byte : array.bytes) byte = static_cast<std::byte>(random.below(64));
      mesh.arrays.push_back(std::move(array));
    }
  }
  mesh.arrays.push_back(
      array_of<uint8_t>("x", Domain::point, Scalar::u8, 1, std::vector<uint8_t>(points, 1)));
  mesh.arrays.push_back(array_of<float>("nx", Domain::point, Scalar::f32, 1, std::vector<float>(points, 2)));
  mesh.arrays.push_back(array_of<float>("", Domain::point, Scalar::f32, 1, std::vector<float>(points, 3)));
  Array label = array_of<uint8_t>("part", Domain::cell, Scalar::u8, 1, {0, 1, 1, 0}, Role::label);
  label.labels = {"left wing", "", "100 %\nof it"};
  mesh.arrays.push_back(label);
  mesh.metadata.emplace_back("mtllib", "some file.mtl");
  mesh.metadata.emplace_back("comment", "two\nlines");
  // Edges do not have corner arrays in PLY: those are zero, as the reader makes them.
  for (Array& array : mesh.arrays) {
    if (array.domain != Domain::corner) continue;
    std::fill(array.bytes.end() - static_cast<ptrdiff_t>(2 * array.tuple_size()), array.bytes.end(),
              std::byte{0});
  }
  for (const bool ascii : {false, true}) {
    WriteOptions options;
    options.ascii = ascii;
    const testing::Written written = write_text(ply_format(), mesh, options);
    const Mesh back = read_ply(written.text).mesh;
    ASSERT_EQ(back.arrays.size(), mesh.arrays.size());
    for (const Array& array : mesh.arrays) {
      const Array* same = back.find(array.name, array.domain);
      ASSERT_TRUE(same) << array.name << " " << name_of(array.domain);
      testing::expect_same_array(array, *same);
    }
    for (const auto& pair : mesh.metadata) {
      if (pair.first == "ply.order") continue;  // now with the elements of the arrays
      EXPECT_NE(std::find(back.metadata.begin(), back.metadata.end(), pair), back.metadata.end())
          << pair.first;
    }
  }
}

TEST(PlyWriter, TakesPolygonsOfMoreThan255Corners) {
  Mesh mesh;
  mesh.points.resize(300);
  CellBlock block;
  block.offsets = {0, 300};
  for (uint32_t i = 0; i < 300; ++i) block.connectivity.push_back(i);
  mesh.blocks.push_back(block);
  mesh.arrays.push_back(array_of<float>("texcoord", Domain::corner, Scalar::f32, 2,
                                        std::vector<float>(600, 0.5f), Role::texture_coordinate));
  const Mesh back = read_ply(write_text(ply_format(), mesh).text).mesh;
  EXPECT_EQ(back.blocks[0].connectivity, mesh.blocks[0].connectivity);
  EXPECT_EQ(values_of<float>(back, "texcoord", Domain::corner), std::vector<float>(600, 0.5f));
}

TEST(PlyWriter, WritesNoMorePropertiesThanAreRead) {
  Mesh mesh = read_ply(one_vertex("float", "0")).mesh;
  for (int i = 0; i < 4094; ++i) {
    mesh.arrays.push_back(make_array("a" + std::to_string(i), Domain::point, Scalar::u8, 1));
    mesh.arrays.back().resize(mesh.point_count());
  }
  std::vector<std::byte> file;
  const auto written = write_mesh(mesh, *memory_sink(file), {"ply"});
  ASSERT_FALSE(written);
  EXPECT_EQ(
      written.error().message,
      "a vertex would have 4097 properties in PLY, of which no more than 4096 are read; leave some arrays "
      "out (the command: --arrays)");
}

TEST(PlyWriter, SaysWhatItLeavesOut) {
  Mesh mesh = read_ply(everything).mesh;
  mesh.blocks[0].name = "roof";
  CellBlock tetrahedron;
  tetrahedron.type = CellType::tetrahedron;
  tetrahedron.connectivity = {0, 1, 2, 3};
  Mesh volume;
  volume.points = mesh.points;
  volume.blocks.push_back(tetrahedron);
  const auto sink_bytes = std::make_unique<std::vector<std::byte>>();
  const auto sink = memory_sink(*sink_bytes);
  const auto result = ply_format().write(volume, *sink, {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::usage);
  volume.blocks.push_back({"", CellType::triangle, {}, {}, {0, 1, 2}});
  volume.blocks.back().name = "roof";
  const testing::Written written = write_text(ply_format(), volume);
  ASSERT_EQ(written.notes.size(), 2u);
  EXPECT_THAT(written.notes[0], HasSubstr("1 cell"));
  EXPECT_THAT(written.notes[1], HasSubstr("names of 1 block"));
}

TEST(PlyWriter, WritesMeshesOfNothing) {
  Mesh mesh;
  expect_same_mesh(read_ply(write_text(ply_format(), mesh).text).mesh, mesh);
}

/// Random surfaces of every pathology, with arrays of every type, come back as the same mesh.
RC_GTEST_PROP(PlyRoundTrip, IsExact, (uint64_t seed, bool big_endian)) {
  testing::RandomMeshOptions options;
  options.several_blocks = false;
  const Mesh mesh = testing::random_surface(seed, options);
  WriteOptions write;
  write.big_endian = big_endian;
  const Mesh back = read_ply(write_text(ply_format(), mesh, write).text).mesh;
  RC_ASSERT(back.points.type == mesh.points.type);
  RC_ASSERT(back.points.bytes == mesh.points.bytes);
  RC_ASSERT(back.cell_count() == mesh.cell_count());
  if (mesh.cell_count() != 0) {
    RC_ASSERT(back.blocks[0].connectivity == mesh.blocks[0].connectivity);
    for (uint64_t cell = 0; cell < mesh.cell_count(); ++cell) {
      RC_ASSERT(back.blocks[0].cell(cell).size() == mesh.blocks[0].cell(cell).size());
    }
  }
  RC_ASSERT(back.arrays.size() == mesh.arrays.size());
  for (const Array& array : mesh.arrays) {
    const Array* same = back.find(array.name, array.domain);
    RC_ASSERT(same != nullptr);
    RC_ASSERT(same->type == array.type);
    RC_ASSERT(same->components == array.components);
    RC_ASSERT(same->role == array.role);
    RC_ASSERT(same->labels == array.labels);
    RC_ASSERT(same->bytes == array.bytes);
  }
}

}  // namespace
}  // namespace maille
