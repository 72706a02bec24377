#include "io/vtk/vtp.h"

#include <gtest/gtest.h>

#include <zlib.h>
#include <filesystem>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/base64.h"
#include "io/format.h"
#include "io/same_mesh.h"
#include "support/data.h"
#include "support/random.h"
#include "support/random_mesh.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::Values;

Result<ReadResult> read(std::string_view text) {
  return read_text(vtp_format(), text, "test.vtp");
}

std::string error_of(std::string_view text) {
  const auto result = read(text);
  return result ? "no error" : result.error().message;
}

/// A file in ascii: a vertex, two lines, a triangle and a quad, a strip of three triangles.
std::string small_file() {
  return R"(<?xml version="1.0"?>
<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">
 <PolyData>
  <FieldData>
   <DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">2.5</DataArray>
   <Array type="String" Name="title" NumberOfTuples="1" format="ascii">104 105 0</Array>
  </FieldData>
  <Piece NumberOfPoints="5" NumberOfVerts="1" NumberOfLines="2" NumberOfStrips="1" NumberOfPolys="2">
   <PointData Normals="N" Scalars="RGB">
    <DataArray type="Float32" Name="N" NumberOfComponents="3" format="ascii">
      0 0 1  0 0 1  0 0 1  0 0 1  0 0 -1e0</DataArray>
    <DataArray type="UInt8" Name="RGB" NumberOfComponents="3" format="ascii">
      0 0 1  0 0 1  0 0 1  0 0 1  0 255 7</DataArray>
   </PointData>
   <CellData>
    <DataArray type="Int64" Name="id" format="ascii">10 20 21 30 31 -40</DataArray>
   </CellData>
   <Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
     0 0 0  1 0 0  1 1 0  0 1 0  0.1 nan -0</DataArray></Points>
   <Verts><DataArray type="Int32" Name="connectivity" format="ascii">4</DataArray>
     <DataArray type="Int32" Name="offsets" format="ascii">1</DataArray></Verts>
   <Lines><DataArray type="Int64" Name="connectivity" format="ascii">0 1 1 2 3</DataArray>
     <DataArray type="Int64" Name="offsets" format="ascii">2 5</DataArray></Lines>
   <Strips><DataArray type="Int32" Name="connectivity" format="ascii">0 1 3 2 4</DataArray>
     <DataArray type="Int32" Name="offsets" format="ascii">5</DataArray></Strips>
   <Polys><DataArray type="UInt8" Name="connectivity" format="ascii">0 1 2 0 1 2 3</DataArray>
     <DataArray type="UInt8" Name="offsets" format="ascii">3 7</DataArray></Polys>
  </Piece>
 </PolyData>
</VTKFile>
)";
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

TEST(VtpReader, ReadsAllKindsOfCellsAndSplitsStrips) {
  const auto result = read(small_file());
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  ASSERT_EQ(mesh.blocks.size(), 4u);
  EXPECT_EQ(mesh.blocks[0].type, CellType::vertex);
  EXPECT_EQ(mesh.blocks[1].type, CellType::poly_line);
  EXPECT_EQ(mesh.blocks[1].offsets, (std::vector<uint64_t>{0, 2, 5}));
  EXPECT_EQ(mesh.blocks[2].type, CellType::polygon);
  EXPECT_EQ(mesh.blocks[2].connectivity, (std::vector<uint32_t>{0, 1, 2, 0, 1, 2, 3}));
  EXPECT_EQ(mesh.blocks[3].type, CellType::triangle);
  EXPECT_EQ(mesh.blocks[3].connectivity, (std::vector<uint32_t>{0, 1, 3, 1, 2, 3, 3, 2, 4}));
  ASSERT_EQ(result->notes.size(), 1u);
  EXPECT_NE(result->notes[0].find("strip"), std::string::npos);
}

TEST(VtpReader, CellArraysFollowTheirCellsAlsoThroughStrips) {
  const auto result = read(small_file());
  ASSERT_TRUE(result) << result.error().message;
  const Array* id = result->mesh.find("id", Domain::cell);
  ASSERT_TRUE(id);
  const auto values = id->values<int64_t>();
  EXPECT_EQ(std::vector<int64_t>(values.begin(), values.end()),
            (std::vector<int64_t>{10, 20, 21, 30, 31, -40, -40, -40}));
}

TEST(VtpReader, KeepsDoublesRolesFieldsAndText) {
  const auto result = read(small_file());
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  ASSERT_EQ(mesh.points.type, Scalar::f64);
  EXPECT_EQ(mesh.points.values<double>()[12], 0.1);
  EXPECT_TRUE(std::isnan(mesh.points.values<double>()[13]));
  EXPECT_TRUE(std::signbit(mesh.points.values<double>()[14]));
  EXPECT_EQ(mesh.find("N", Domain::point)->role, Role::normal);
  EXPECT_EQ(mesh.find("RGB", Domain::point)->role, Role::colour);
  EXPECT_EQ(mesh.find("TimeValue", Domain::mesh)->values<double>()[0], 2.5);
  using Metadata = std::vector<std::pair<std::string, std::string>>;
  EXPECT_EQ(mesh.metadata, (Metadata{{"title", "hi"}, {"vtk.text", "mesh title"}}));
}

/// The ways binary data may be stored in a VTK XML file.
struct Storage {
  bool appended = false;
  bool base64 = true;
  bool zlib = false;
  bool wide_header = false;
  bool big_endian = false;
  bool split_header = false;  ///< header and data encoded separately, as some writers do
};

/// Stores arrays as VTK does; independent of the writer under test.
class Storer {
 public:
  explicit Storer(Storage storage) : storage_(storage) {}

  template <class T>
  std::string array(const std::string& type, const std::string& more, std::vector<T> values) {
    const std::string data = stored(values);
    const std::string tag = "<DataArray type=\"" + type + "\" " + more;
    if (!storage_.appended) return tag + " format=\"binary\">\n  " + data + "\n</DataArray>";
    const std::string offset = std::to_string(appended_.size());
    appended_ += data;
    return tag + " format=\"appended\" offset=\"" + offset + "\"/>";
  }
  std::string root() const {
    return std::string("<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"") +
           (storage_.big_endian ? "BigEndian" : "LittleEndian") + "\"" +
           (storage_.wide_header ? " header_type=\"UInt64\"" : "") +
           (storage_.zlib ? " compressor=\"vtkZLibDataCompressor\">" : ">");
  }
  std::string tail() const {
    if (!storage_.appended) return "</VTKFile>";
    return std::string("<AppendedData encoding=\"") + (storage_.base64 ? "base64" : "raw") + "\">\n   _" +
           appended_ + "\n  </AppendedData>\n</VTKFile>\n";
  }

 private:
  template <class T>
  std::string raw(T value) const {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    if (storage_.big_endian) bytes.assign(bytes.rbegin(), bytes.rend());
    return bytes;
  }
  std::string number(uint64_t value) const {
    return storage_.wide_header ? raw(value) : raw(static_cast<uint32_t>(value));
  }
  std::string encoded(const std::string& bytes) const {
    return storage_.base64 ? to_base64(std::as_bytes(std::span(bytes.data(), bytes.size()))) : bytes;
  }
  template <class T>
  std::string stored(const std::vector<T>& values) const {
    std::string data;
    for (const T value : values) data += raw(value);
    if (!storage_.zlib) {
      const std::string header = number(data.size());
      return storage_.split_header ? encoded(header) + encoded(data) : encoded(header + data);
    }
    constexpr size_t block = 16;  // several blocks, the last one shorter
    std::string packed, sizes;
    const size_t blocks = (data.size() + block - 1) / block;
    for (size_t i = 0; i < blocks; ++i) {
      const std::string part = data.substr(i * block, block);
      uLongf size = compressBound(part.size());
      std::string out(size, '\0');
      compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(part.data()),
               part.size());
      packed += out.substr(0, size);
      sizes += number(size);
    }
    return encoded(number(blocks) + number(block) + number(data.size() % block) + sizes) + encoded(packed);
  }

  Storage storage_;
  std::string appended_;
};

std::string stored_file(Storage storage) {
  Storer store(storage);
  std::string text =
      store.root() + "<PolyData><Piece NumberOfPoints=\"4\" NumberOfPolys=\"2\"><PointData>" +
      store.array<int16_t>("Int16", "Name=\"short\"", {-1, 2, -300, 32767}) + "</PointData>" + "<CellData>" +
      store.array<double>("Float64", "Name=\"p\"", {0.1, -0.0}) + "</CellData>" + "<Points>" +
      store.array<float>("Float32", "NumberOfComponents=\"3\"", {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0.25f}) +
      "</Points><Polys>" + store.array<int64_t>("Int64", "Name=\"connectivity\"", {0, 1, 2, 0, 2, 3}) +
      store.array<int64_t>("Int64", "Name=\"offsets\"", {3, 6}) + "</Polys></Piece></PolyData>";
  return text + store.tail();
}

class VtpStorage : public ::testing::TestWithParam<Storage> {};

TEST_P(VtpStorage, GivesTheSameValues) {
  const auto result = read(stored_file(GetParam()));
  ASSERT_TRUE(result) << result.error().message;
  Mesh expected;
  expected.points =
      array_of<float>("position", Domain::point, Scalar::f32, 3, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0.25f});
  expected.blocks.push_back({"", CellType::triangle, {}, {}, {0, 1, 2, 0, 2, 3}});
  expected.arrays.push_back(array_of<int16_t>("short", Domain::point, Scalar::i16, 1, {-1, 2, -300, 32767}));
  expected.arrays.push_back(array_of<double>("p", Domain::cell, Scalar::f64, 1, {0.1, -0.0}));
  expect_same_mesh(result->mesh, expected);
}

TEST_P(VtpStorage, EveryTruncationIsAnError) {
  const std::string text = stored_file(GetParam());
  const size_t end = text.rfind('>') + 1;
  for (size_t size = 0; size < end; ++size) {
    EXPECT_FALSE(read(text.substr(0, size))) << "of " << end << " bytes only " << size;
  }
}

TEST_P(VtpStorage, RandomDamageIsAnErrorOrAValidMesh) {
  const std::string text = stored_file(GetParam());
  Random random(7);
  for (int trial = 0; trial < 300; ++trial) {
    std::string damaged = text;
    for (uint32_t i = random.between(1, 4); i > 0; --i) {
      damaged[random.below(damaged.size())] = static_cast<char>(random.below(256));
    }
    read(damaged);  // checks that what is read is valid
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, VtpStorage,
    Values(Storage{}, Storage{.split_header = true}, Storage{.wide_header = true},
           Storage{.wide_header = true, .big_endian = true}, Storage{.zlib = true},
           Storage{.zlib = true, .wide_header = true, .big_endian = true}, Storage{.appended = true},
           Storage{.appended = true, .base64 = false},
           Storage{.appended = true, .base64 = false, .wide_header = true, .big_endian = true},
           Storage{.appended = true, .base64 = false, .zlib = true},
           Storage{.appended = true, .zlib = true}));

TEST(VtpReader, JoinsPieces) {
  const std::string one = small_file();
  const size_t begin = one.find("  <Piece"), end = one.find("</Piece>") + 9;
  const std::string piece = one.substr(begin, end - begin);
  const auto result = read(one.substr(0, end) + piece + one.substr(end));
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  EXPECT_EQ(mesh.point_count(), 10u);
  ASSERT_EQ(mesh.blocks.size(), 4u);
  EXPECT_EQ(mesh.blocks[0].connectivity, (std::vector<uint32_t>{4, 9}));
  EXPECT_EQ(mesh.blocks[2].connectivity.back(), 8u);
  const auto ids = mesh.find("id", Domain::cell)->values<int64_t>();
  EXPECT_EQ(std::vector<int64_t>(ids.begin(), ids.begin() + 6),
            (std::vector<int64_t>{10, 10, 20, 21, 20, 21}));
}

TEST(VtpReader, PiecesWithOtherArraysAreAnError) {
  const std::string one = small_file();
  const size_t begin = one.find("  <Piece"), end = one.find("</Piece>") + 9;
  const std::string piece = replaced(one.substr(begin, end - begin), "Name=\"RGB\"", "Name=\"other\"");
  EXPECT_NE(error_of(one.substr(0, end) + piece + one.substr(end)).find("same arrays"), std::string::npos);
}

TEST(VtpReader, NamesWhatIsWrong) {
  const auto expect = [](const std::string& what, const std::string& by, const std::string& message) {
    const std::string error = error_of(replaced(small_file(), what, by));
    EXPECT_EQ(error.find("test.vtp: "), 0u) << error;
    EXPECT_NE(error.find(message), std::string::npos) << error;
  };
  expect("0 0 -1e0", "0 0 x", "value 14 is \"x\"");
  expect("10 20 21", "10 20", "5 tuples for 6 cells");
  expect(">0 1 1 2 3<", ">0 1 1 2 5<", "cell 1 uses point 5");
  expect(">0 1 1 2 3<", ">0 1 1 2 -1<", "cell 1 uses point -1");
  expect(">2 5<", ">3 2<", "the end of cell 1 is offset 2");
  expect(">2 5<", ">2 6<", "the end of cell 1 is offset 6");
  expect("NumberOfPolys=\"2\"", "NumberOfPolys=\"99999999999999\"", "there are 2 offsets");
  expect("NumberOfPoints=\"5\"", "NumberOfPoints=\"18446744073709551615\"", "NumberOfPoints is");
  expect("type=\"PolyData\"", "type=\"UnstructuredGrid\"", "only PolyData");
  expect("0 0 1  0 255 7", "0 0 1  0 256 7", "does not fit its type");
  expect("Int64\" Name=\"id\"", "Complex\" Name=\"id\"", "no VTK number type");
  expect("Int64\" Name=\"id\"", "Bit\" Name=\"id\"", "save the array as UInt8");
  expect("</PointData>", "</PiontData>", "line 14: not well-formed XML");
  expect("byte_order", "compressor=\"vtkZstdDataCompressor\" byte_order", "save it again with zlib");
}

TEST(VtpReader, HostileSizesAreErrorsBeforeTheyAreMemory) {
  std::string bytes(8, '\xff');
  const std::string huge = to_base64(std::as_bytes(std::span(bytes.data(), bytes.size())));
  const std::string head =
      "<VTKFile type=\"PolyData\" header_type=\"UInt64\"%><PolyData><Piece NumberOfPoints=\"1\"><Points>"
      "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"binary\">";
  const std::string tail = "</DataArray></Points></Piece></PolyData></VTKFile>";
  EXPECT_NE(error_of(replaced(head, "%", "") + huge + tail).find("should go on"), std::string::npos);
  const std::string zlib = replaced(head, "%", " compressor=\"vtkZLibDataCompressor\"");
  EXPECT_NE(error_of(zlib + huge + huge + huge + tail).find("should go on"), std::string::npos);
}

Mesh small_mesh() {
  Mesh mesh;
  mesh.points = array_of<double>("position", Domain::point, Scalar::f64, 3,
                                 {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 1e-300, 5, 5, -0.0});
  mesh.blocks.push_back({"", CellType::vertex, {}, {}, {4}});
  mesh.blocks.push_back({"", CellType::line, {}, {}, {0, 1, 1, 2}});
  mesh.blocks.push_back({"", CellType::polygon, {}, {0, 3, 7, 7}, {0, 1, 2, 0, 1, 2, 3}});
  mesh.arrays.push_back(
      array_of<float>("n", Domain::point, Scalar::f32, 3, std::vector<float>(15, 0.5f), Role::normal));
  mesh.arrays.push_back(
      array_of<uint8_t>("c", Domain::point, Scalar::u8, 4, std::vector<uint8_t>(20, 9), Role::colour));
  mesh.arrays.push_back(array_of<float>("uv", Domain::point, Scalar::f32, 2, std::vector<float>(10, 0.25f),
                                        Role::texture_coordinate));
  mesh.arrays.push_back(
      array_of<uint64_t>("big & <odd>", Domain::cell, Scalar::u64, 1, {1, 2, 3, 4, 5, ~uint64_t{0}}));
  return mesh;
}

/// What FieldData holds comes between point and cell arrays.
void add_field_arrays(Mesh& mesh) {
  Array corner = array_of<float>("corner uv", Domain::corner, Scalar::f32, 1, std::vector<float>(12, 1.5f),
                                 Role::texture_coordinate);
  Array field = array_of<int8_t>("field", Domain::mesh, Scalar::i8, 2, {1, -2, 3, -4});
  mesh.arrays.insert(mesh.arrays.end() - 1, {corner, field});
  Array label = array_of<uint16_t>("material", Domain::cell, Scalar::u16, 1, {0, 1, 0, 1, 0, 1}, Role::label);
  label.labels = {"steel", "w\"ood"};
  mesh.arrays.push_back(label);
  mesh.metadata = {{"comment", "two\nlines"}, {"unit", "mm"}};
}

TEST(VtpWriter, IsTheInverseOfTheReader) {
  Mesh mesh = small_mesh();
  add_field_arrays(mesh);
  for (const WriteOptions& options :
       {WriteOptions{}, WriteOptions{"", true, false}, WriteOptions{"", false, true}}) {
    const Written written = write_text(vtp_format(), mesh, options);
    const auto back = read(written.text);
    ASSERT_TRUE(back) << back.error().message;
    expect_same_mesh(back->mesh, mesh);
  }
}

TEST(VtpWriter, BinaryKeepsEveryBit) {
  Mesh mesh = small_mesh();
  const uint64_t odd_nan = 0x7ff4deadbeef0001;
  std::memcpy(mesh.points.bytes.data(), &odd_nan, sizeof odd_nan);
  const auto back = read(write_text(vtp_format(), mesh).text);
  ASSERT_TRUE(back) << back.error().message;
  expect_same_mesh(back->mesh, mesh);
}

TEST(VtpWriter, ReorderedCellsTakeTheirArraysAlong) {
  Mesh mesh = small_mesh();
  std::swap(mesh.blocks[0], mesh.blocks[2]);  // polygons, lines, vertex
  mesh.arrays.push_back(
      array_of<int32_t>("corner", Domain::corner, Scalar::i32, 1, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}));
  const Written written = write_text(vtp_format(), mesh);
  EXPECT_FALSE(written.notes.empty());
  const auto back = read(written.text);
  ASSERT_TRUE(back) << back.error().message;
  const auto cells = back->mesh.find("big & <odd>", Domain::cell)->values<uint64_t>();
  EXPECT_EQ(std::vector<uint64_t>(cells.begin(), cells.end()),
            (std::vector<uint64_t>{~uint64_t{0}, 4, 5, 1, 2, 3}));
  const auto corners = back->mesh.find("corner", Domain::corner)->values<int32_t>();
  EXPECT_EQ(std::vector<int32_t>(corners.begin(), corners.end()),
            (std::vector<int32_t>{11, 7, 8, 9, 10, 0, 1, 2, 3, 4, 5, 6}));
}

TEST(VtpWriter, SaysWhatItCannotHold) {
  Mesh mesh = small_mesh();
  mesh.arrays.clear();
  mesh.blocks[2].name = "hull";
  mesh.blocks.push_back({"", CellType::tetrahedron, {}, {}, {0, 1, 2, 3}});
  const Written written = write_text(vtp_format(), mesh);
  ASSERT_EQ(written.notes.size(), 2u);
  EXPECT_NE(written.notes[0].find("1 volume or quadratic cell left out"), std::string::npos);
  EXPECT_NE(written.notes[1].find("named blocks"), std::string::npos);
  const auto back = read(written.text);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->mesh.find("block", Domain::cell)->labels[2], "hull");

  mesh.blocks.erase(mesh.blocks.begin(), mesh.blocks.begin() + 3);
  std::vector<std::byte> bytes;
  const auto refused = vtp_format().write(mesh, *memory_sink(bytes), {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
}

TEST(VtpWriter, RandomMeshesComeBack) {
  RandomMeshOptions options;
  options.other_cells = false;
  for (uint64_t seed = 0; seed < 200; ++seed) {
    Mesh mesh = random_surface(seed, options);
    const auto back = read(write_text(vtp_format(), mesh).text);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->mesh.cell_count(), mesh.cell_count());
    EXPECT_TRUE(back->mesh.points.bytes == mesh.points.bytes) << seed;
    for (const Array& array : mesh.arrays) {
      const Array* found = back->mesh.find(array.name, array.domain);
      ASSERT_TRUE(found) << seed << " " << array.name;
      EXPECT_TRUE(found->bytes == array.bytes) << seed << " " << array.name;
      EXPECT_EQ(found->role, array.role) << seed << " " << array.name;
    }
  }
}

TEST(VtpReader, ReadsARealFileAndItsCopy) {
  // The second out of strips, where meshes come from Debian's packages (scripts/data).
  const struct {
    std::string name;
    uint64_t points, cells, triangles;
  } files[] = {{"Torso.vtp", 12015, 12448, 1134}, {"cranium_skin.vtp", 143110, 280251, 280251}};
  const auto file = std::find_if(std::begin(files), std::end(files), [](const auto& each) {
    return std::filesystem::exists(data_folder() + "/poly/" + each.name);
  });
  if (file == std::end(files)) GTEST_SKIP() << "no VTP file is among the real meshes on this machine";
  const auto result = read_file(vtp_format(), data_folder() + "/poly/" + file->name);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.point_count(), file->points);
  EXPECT_EQ(result->mesh.cell_count(), file->cells);
  uint64_t triangles = 0;
  const CellBlock& block = result->mesh.blocks.at(0);
  for (uint64_t i = 0; i < block.size(); ++i) triangles += block.cell(i).size() == 3;
  EXPECT_EQ(triangles, file->triangles);
  const auto back = read(write_text(vtp_format(), result->mesh).text);
  ASSERT_TRUE(back) << back.error().message;
  expect_same_mesh(back->mesh, result->mesh);
}

}  // namespace
}  // namespace maille
