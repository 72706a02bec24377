#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "base/bytes.h"
#include "io/same_mesh.h"
#include "io/stl/stl.h"
#include "support/codec.h"
#include "support/random.h"
#include "support/shapes.h"

namespace maille {
namespace {

using testing::array_of;
using testing::expect_same_mesh;
using ::testing::HasSubstr;
using testing::write_text;

ReadResult read_stl(std::string_view text) {
  return testing::read_good_text(stl_format(), text, "test.stl");
}

std::string error_of(std::string_view text) {
  return testing::error_of_text(stl_format(), text, "test.stl");
}

std::string facet(const std::string& normal, const std::string& a, const std::string& b,
                  const std::string& c) {
  return "  facet normal " + normal + "\n    outer loop\n      vertex " + a + "\n      vertex " + b +
         "\n      vertex " + c + "\n    endloop\n  endfacet\n";
}

/// A binary file of the given facets of 12 floats and an attribute each.
std::string binary(const std::string& header,
                   const std::vector<std::pair<std::array<float, 12>, uint16_t>>& facets) {
  std::string text = header;
  text.resize(80);
  const auto append = [&](const auto& value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  append(static_cast<uint32_t>(facets.size()));
  for (const auto& [numbers, attribute] : facets) {
    append(numbers);
    append(attribute);
  }
  return text;
}

const std::array<float, 12> lower = {0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 1, 0};
const std::array<float, 12> upper = {0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 1, 0};

TEST(StlReader, WeldsEqualCorners) {
  const ReadResult result = read_stl(binary("a part", {{lower, 0}, {upper, 0}}));
  EXPECT_EQ(result.mesh.points.type, Scalar::f32);
  EXPECT_EQ(result.mesh.point_count(), 4u);
  EXPECT_EQ(result.mesh.blocks[0].type, CellType::triangle);
  EXPECT_EQ(result.mesh.blocks[0].connectivity, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3}));
  EXPECT_THAT(result.notes[0], HasSubstr("welded 6 corners into 4 points"));
  EXPECT_THAT(result.notes[1], HasSubstr("follow from the positions"));
  EXPECT_TRUE(result.mesh.arrays.empty());
  EXPECT_EQ(result.mesh.metadata[0], (std::pair<std::string, std::string>("stl.header", "a%20part")));
}

TEST(StlReader, KeepsZerosOfBothSignsApart) {
  std::array<float, 12> minus = lower;
  minus[3] = -0.0f;
  EXPECT_EQ(read_stl(binary("", {{lower, 0}, {minus, 0}})).mesh.point_count(), 4u);
}

TEST(StlReader, KeepsNormalsThatDoNotFollow) {
  std::array<float, 12> other = upper;
  other[1] = 1e-30f;
  const ReadResult result = read_stl(binary("", {{lower, 0}, {other, 0}}));
  const Array* normal = result.mesh.find("normal", Domain::cell);
  ASSERT_TRUE(normal);
  EXPECT_EQ(normal->values<float>()[4], 1e-30f);
  EXPECT_THAT(result.notes[1], HasSubstr("kept as an array"));
}

TEST(StlReader, KnowsNormalsLeftZero) {
  std::array<float, 12> zero = lower;
  zero[2] = 0;
  const std::string text = binary("", {{zero, 0}});
  const ReadResult result = read_stl(text);
  EXPECT_TRUE(result.mesh.arrays.empty());
  EXPECT_EQ(write_text(stl_format(), result.mesh).text, text);
}

TEST(StlReader, KeepsAttributes) {
  const ReadResult result = read_stl(binary("", {{lower, 0}, {upper, 0x8001}}));
  const Array* attribute = result.mesh.find("attribute", Domain::cell);
  ASSERT_TRUE(attribute);
  EXPECT_EQ(attribute->type, Scalar::u16);
  EXPECT_EQ(attribute->values<uint16_t>()[1], 0x8001);
}

TEST(StlReader, ReadsBinaryThatBeginsWithSolid) {
  EXPECT_EQ(read_stl(binary("solid or so it says", {{lower, 0}})).mesh.cell_count(), 1u);
}

TEST(StlReader, ReadsTextOfSeveralSolids) {
  const std::string text = "solid left wing\n" + facet("0 0 1", "0 0 0", "1 0 0", "1 1 0") +
                           "endsolid left wing\nsolid\nendsolid\nsolid b\n" +
                           facet("0 0 1", "0 0 0", "1 1 0", "0 1 0") + "endsolid b\n";
  const Mesh mesh = read_stl(text).mesh;
  EXPECT_EQ(mesh.point_count(), 4u);
  const Array* solid = mesh.find("solid", Domain::cell);
  ASSERT_TRUE(solid);
  EXPECT_EQ(solid->role, Role::label);
  EXPECT_EQ(solid->labels, (std::vector<std::string>{"left wing", "", "b"}));
  EXPECT_EQ(solid->values<uint32_t>()[1], 2u);
}

TEST(StlReader, TakesTheFormsOfOtherPrograms) {
  const std::string text =
      "SOLID x\r\nFACET NORMAL 0 0 1\r\nOUTER LOOP VERTEX 0 0 0\r\nVertex 1E0 0 0 vertex +1 1. 0 "
      "ENDLOOP ENDFACET ENDSOLID";
  EXPECT_EQ(read_stl(text).mesh.cell_count(), 1u);
  EXPECT_EQ(read_stl("solid\nendsolid\n").mesh.point_count(), 0u);
}

TEST(StlReader, UsesDoublesWhereFloatsWouldLose) {
  const std::string text = "solid a\n" + facet("0 0 1", "0 0 0", "2594140.20 0 0", "1 1 0") + "endsolid a\n";
  EXPECT_EQ(read_stl(text).mesh.points.type, Scalar::f64);
}

TEST(StlReader, NamesWhatIsWrong) {
  const std::string good = "solid a\n" + facet("0 0 1", "0 0 0", "1 0 0", "1 1 0");
  EXPECT_EQ(error_of(good), "test.stl: line 9: facet 1: the end of the file stands where \"facet\" belongs");
  EXPECT_EQ(error_of(good + "facet normal 0 0 up\n"),
            "test.stl: line 9: facet 1: \"up\" stands where a number belongs");
  EXPECT_EQ(error_of("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nendloop\n"),
            "test.stl: line 6: facet 0: \"endloop\" stands where \"vertex\" belongs");
  EXPECT_EQ(
      error_of(
          "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nvertex 1 1 1\nvertex 2 2 2\n"),
      "test.stl: line 7: facet 0: \"vertex\" stands where \"endloop\" belongs");
  EXPECT_THAT(error_of("x"), HasSubstr("too short for a binary STL"));
  std::string cut = binary("", {{lower, 0}, {upper, 0}});
  cut.pop_back();
  EXPECT_EQ(error_of(cut), "test.stl: byte 183: the file ends inside facet 1 of 2");
}

TEST(StlReader, DoesNotBelieveTheCount) {
  std::string text = binary("", {{lower, 0}});
  for (int i = 80; i < 84; ++i) text[static_cast<size_t>(i)] = '\377';
  EXPECT_THAT(error_of(text), HasSubstr("facet 1 of 4294967295"));
}

TEST(StlReader, SaysWhatStandsBehindTheEnd) {
  const ReadResult result = read_stl(binary("", {{lower, 0}}) + "tail");
  EXPECT_EQ(result.mesh.cell_count(), 1u);
  EXPECT_THAT(result.notes.back() + result.notes.front() + result.notes[1],
              HasSubstr("4 bytes behind the last facet"));
}

TEST(StlReader, RejectsEveryTruncation) {
  const std::string bytes = binary("some header", {{lower, 0}, {upper, 7}});
  for (size_t length = 0; length < bytes.size(); ++length) error_of(bytes.substr(0, length));
  const std::string text = "solid a\n" + facet("0 0 1", "0 0 0", "1 0 0", "1 1 0") + "endsolid a\n";
  for (size_t length = 1; length < text.size() - 3; ++length) {
    EXPECT_NE(error_of(text.substr(0, length)), "no error") << length;
  }
}

TEST(StlWriter, RestoresBinaryFiles) {
  for (const std::string& text :
       {binary("", {}), binary("part  ", {{lower, 0}, {upper, 0}}),
        binary(std::string("COLOR=\1\2\377\0x", 11), {{upper, 3}}),
        binary(std::string(80, '%'), {{{1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0}, 0}})}) {
    EXPECT_EQ(write_text(stl_format(), read_stl(text).mesh).text, text);
  }
}

TEST(StlWriter, RestoresTextFiles) {
  WriteOptions options;
  options.ascii = true;
  const std::string two = "solid a\n" + facet("0 0 1", "0 0 0", "1 0 0", "1 1 0") +
                          "endsolid a\nsolid b c\n" + facet("0 1 0", "0 0 0", "1 1 0", "0 0.1 -0") +
                          "endsolid b c\n";
  for (const std::string& text :
       {two, std::string("solid\nendsolid\n"), std::string("solid empty\nendsolid empty\n"),
        "solid only\n" + facet("0 0 1", "0 0 0", "1 0 0", "1 1 0") + "endsolid only\n"}) {
    EXPECT_EQ(write_text(stl_format(), read_stl(text).mesh, options).text, text);
  }
}

TEST(StlWriter, CutsPolygonsAndSaysSo) {
  Mesh mesh = testing::cube();
  mesh.arrays.push_back(array_of<float>("height", Domain::point, Scalar::f32, 1, std::vector<float>(8, 1)));
  mesh.points.resize(9);
  mesh.arrays[0].resize(9);
  const testing::Written written = write_text(stl_format(), mesh);
  EXPECT_EQ(written.notes, (std::vector<std::string>{"6 polygons cut into 12 triangles (fans)",
                                                     "1 point that no triangle uses left out",
                                                     "array \"height\" on points left out"}));
  const ReadResult back = read_stl(written.text);
  EXPECT_EQ(back.mesh.cell_count(), 12u);
  EXPECT_EQ(back.mesh.point_count(), 8u);
  EXPECT_TRUE(back.mesh.arrays.empty());  // normals are those the reader expects
}

TEST(StlWriter, SaysThatDoublesAreRounded) {
  Mesh mesh = testing::tetrahedron();
  Array wide = make_array("position", Domain::point, Scalar::f64, 3);
  wide.resize(mesh.point_count());
  for (size_t i = 0; i < wide.values<double>().size(); ++i)
    wide.values<double>()[i] = 0.1 * static_cast<double>(i * i % 7);
  mesh.points = wide;
  EXPECT_EQ(write_text(stl_format(), mesh).notes,
            std::vector<std::string>{"positions were rounded from f64"});
  WriteOptions options;
  options.ascii = true;
  EXPECT_TRUE(write_text(stl_format(), mesh, options).notes.empty());
}

RC_GTEST_PROP(StlRoundTrip, IsExactForFacets, (uint64_t seed)) {
  testing::Random random(seed);
  std::vector<std::pair<std::array<float, 12>, uint16_t>> facets(random.below(40));
  for (auto& [numbers, attribute] : facets) {
    for (float& number : numbers) number = static_cast<float>(random.below(7)) / 3 - 1;
    attribute = static_cast<uint16_t>(random.chance(10) ? random.next() : 0);
  }
  const std::string text = binary("header", facets);
  RC_ASSERT(write_text(stl_format(), read_stl(text).mesh).text == text);
}

using Facet = std::pair<std::array<float, 12>, uint16_t>;

/// As most exporters do it: in double, from edges at corner `base`.
std::array<float, 12> with_normal(std::array<float, 12> facet, size_t base) {
  double u[3];
  double v[3];
  for (size_t k = 0; k < 3; ++k) {
    const double p = facet[3 + 3 * base + k];
    u[k] = double{facet[3 + 3 * ((base + 1) % 3) + k]} - p;
    v[k] = double{facet[3 + 3 * ((base + 2) % 3) + k]} - p;
  }
  const double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  for (size_t k = 0; k < 3; ++k) facet[k] = static_cast<float>(n[k] / length);
  return facet;
}

/// Triangles of a bumpy torus with a flat side, of no symmetry, whose normals start from the corner that
/// `base` gives for the facet and its corners.
template <class Base>
std::vector<Facet> torus_with_normals(Base base) {
  testing::Surface surface = testing::triangulated(testing::shapes::torus(30, 20));
  for (size_t i = 0; i < surface.points.size(); ++i) {
    auto& p = surface.points[i];
    for (double& x : p) x += 0.01 * static_cast<double>(i * i % 37);
    p[0] = std::max(p[0], -2.0);
  }
  std::vector<Facet> facets;
  for (const auto& face : surface.faces) {
    std::array<float, 12> facet{};
    for (size_t i = 0; i < 9; ++i) facet[3 + i] = static_cast<float>(surface.points[face[i / 3]][i % 3]);
    facets.emplace_back(with_normal(facet, base(facets.size(), facet)), 0);
  }
  return facets;
}

/// The records of a file without the order that a mesh does not have: of facets and of where they begin.
std::vector<std::string> records(const std::string& text) {
  std::vector<std::string> records;
  for (size_t at = stl_header_size; at < text.size(); at += stl_facet_size) {
    const std::string corners[] = {text.substr(at + 12, 12), text.substr(at + 24, 12),
                                   text.substr(at + 36, 12)};
    const auto least = static_cast<size_t>(std::min_element(corners, corners + 3) - corners);
    records.push_back(text.substr(at, 12) + corners[least] + corners[(least + 1) % 3] +
                      corners[(least + 2) % 3] + text.substr(at + 48, 2));
  }
  std::sort(records.begin(), records.end());
  return records;
}

/// As `maille compress` and `maille decompress` take a file there and back.
std::string after_coding(const std::string& text, bool keep_order) {
  EncodeOptions options;
  if (keep_order) options.order = Order::keep;
  const auto encoded = testing::encode_bytes(read_stl(text).mesh, options);
  EXPECT_TRUE(encoded) << encoded.error().message;
  const auto mesh = testing::decode_bytes(encoded->bytes);
  EXPECT_TRUE(mesh) << mesh.error().message;
  return write_text(stl_format(), *mesh).text;
}

TEST(StlNormals, ComputedFromAnyCornerComeBackBitForBit) {
  const auto first = [](size_t base) { return [base](size_t, const auto&) { return base; }; };
  const auto mixed = [](size_t facet, const auto&) { return facet * facet % 7 % 3; };
  for (const auto& facets : {torus_with_normals(first(0)), torus_with_normals(first(1)),
                             torus_with_normals(first(2)), torus_with_normals(mixed)}) {
    const std::string text = binary("", facets);
    EXPECT_EQ(read_stl(text).mesh.arrays.size(), 1u) << "their bits depend on the corner";
    EXPECT_EQ(records(after_coding(text, false)), records(text));
    EXPECT_EQ(after_coding(text, true), text);
  }
}

TEST(StlNormals, AreLeftOutWhereEveryOrderGivesThem) {
  const std::string text =
      binary("", torus_with_normals([](size_t, const std::array<float, 12>& facet) {
               std::array<std::array<float, 3>, 3> corners;
               std::memcpy(corners.data(), facet.data() + 3, sizeof corners);
               return static_cast<size_t>(std::min_element(corners.begin(), corners.end()) - corners.begin());
             }));
  EXPECT_TRUE(read_stl(text).mesh.arrays.empty());
  EXPECT_EQ(records(after_coding(text, false)), records(text));
  EXPECT_EQ(after_coding(text, true), text);
}

TEST(StlNormals, ThatDifferAreADifferenceOfTheFiles) {
  std::vector<Facet> facets = torus_with_normals([](size_t, const auto&) { return size_t{0}; });
  const Mesh mesh = read_stl(binary("", facets)).mesh;
  facets[77].first[1] = std::nextafter(facets[77].first[1], 2.0f);
  EXPECT_NE(testing::differences_between(mesh, read_stl(binary("", facets)).mesh), "");
}

}  // namespace
}  // namespace maille
