// What is wrong with the input of a stream, or with its bytes, is told, or kept as it is: the list of
// issue 4.
#include <maille/file.h>

#include <cmath>
#include <limits>

#include "container/file_reader.h"
#include "volume/stream/stream_layout.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

Bytes bytes_of(const std::vector<float>& numbers) {
  return std::as_bytes(std::span(numbers));
}

/// A writer with points 0 to 7, whose values are on `arrays`.
struct Started {
  std::vector<std::byte> bytes;
  std::unique_ptr<Sink> sink = memory_sink(bytes);
  StreamWriter writer;

  explicit Started(StreamOptions options = {}) : writer(*StreamWriter::begin(*sink, std::move(options))) {}
  void add_cube() { ASSERT_TRUE(writer.add_points(0, bytes_of(std::vector<float>(24, 1)))); }
};

const std::vector<uint64_t> cube = {0, 1, 2, 3, 4, 5, 6, 7};

TEST(BadInput, IndicesOutOfRangeAreRefused) {
  Mesh mesh = grid(2, 2, 2);
  mesh.blocks[0].connectivity[5] = 27;
  std::vector<std::byte> bytes;
  const auto report = encode(mesh, *memory_sink(bytes), kept());
  ASSERT_FALSE(report);
  EXPECT_NE(report.error().message.find("27"), std::string::npos) << report.error().message;

  for (const uint64_t wrong : {uint64_t{8}, uint64_t{1} << 40, ~uint64_t{0}}) {
    Started stream;
    stream.add_cube();
    std::vector<uint64_t> cell = cube;
    cell[3] = wrong;
    const bool added = stream.writer.add_cells(CellType::hexahedron, cell).has_value();
    const auto end = stream.writer.finish();
    ASSERT_FALSE(added && end) << wrong;
    EXPECT_TRUE(!added || end.error().code == ErrorCode::malformed_input);
  }
}

TEST(BadInput, PolyhedraThatDoNotAddUpAreRefused) {
  Started stream;
  stream.add_cube();
  const std::vector<uint32_t> sizes = {3, 3};
  EXPECT_FALSE(stream.writer.add_polyhedron(sizes, std::vector<uint64_t>{0, 1, 2, 3, 4}));
  EXPECT_FALSE(stream.writer.add_polyhedron(std::vector<uint32_t>{0xffffffff, 7}, cube));
  EXPECT_FALSE(stream.writer.add_polyhedron({}, cube));
  EXPECT_FALSE(stream.writer.add_cells(CellType::polyhedron, cube));
  EXPECT_TRUE(stream.writer.add_polyhedron(std::vector<uint32_t>{4, 4}, cube));
  EXPECT_TRUE(stream.writer.finish());
}

TEST(BadInput, VerticesThatRepeatAreKept) {
  Mesh mesh = grid(2, 2, 2);
  for (size_t i = 0; i < mesh.blocks[0].connectivity.size(); i += 8)
    std::fill_n(mesh.blocks[0].connectivity.begin() + static_cast<ptrdiff_t>(i), 8 - i / 8,
                mesh.blocks[0].connectivity[i]);
  expect_round_trip(mesh);
  expect_round_trip(mesh, 1);
}

TEST(BadInput, WrongTagsOfLastUseAreRefused) {
  const std::vector<uint8_t> all(8, 1);
  Started again;  // a point that has ended
  again.add_cube();
  ASSERT_TRUE(again.writer.add_cells(CellType::hexahedron, cube, all));
  const bool added = again.writer.add_cells(CellType::hexahedron, cube, all).has_value();
  EXPECT_FALSE(added && again.writer.finish());

  Started by_faces;
  by_faces.add_cube();
  const std::vector<uint32_t> sizes = {4, 4};
  ASSERT_TRUE(by_faces.writer.add_polyhedron(sizes, cube, all));
  const bool more = by_faces.writer.add_polyhedron(sizes, cube).has_value();
  EXPECT_FALSE(more && by_faces.writer.finish());

  Started size;  // not one for each corner
  size.add_cube();
  EXPECT_FALSE(size.writer.add_cells(CellType::hexahedron, cube, std::vector<uint8_t>(7, 1)));

  Started never;  // of a point that never was
  never.add_cube();
  ASSERT_TRUE(never.writer.end_points(std::vector<uint64_t>{99}));
  ASSERT_TRUE(never.writer.add_cells(CellType::hexahedron, cube));
  EXPECT_FALSE(never.writer.finish());
}

TEST(BadInput, ArraysShorterThanDeclaredAreRefused) {
  StreamOptions options;
  options.arrays.push_back({"p", Domain::point, Scalar::f64, 2, Role::none, {}, {}, {}});
  options.arrays.push_back({"c", Domain::cell, Scalar::u8, 1, Role::none, {}, {}, {}});
  Started stream(options);
  const std::vector<float> positions(24);
  const std::vector<std::byte> tuples(8 * 16), one(1);
  const std::array<Bytes, 1> short_one{Bytes(tuples).first(100)}, right{Bytes(tuples)};
  EXPECT_FALSE(stream.writer.add_points(0, bytes_of(positions)));
  EXPECT_FALSE(stream.writer.add_points(0, bytes_of(positions), short_one));
  ASSERT_TRUE(stream.writer.add_points(0, bytes_of(positions), right));
  EXPECT_FALSE(stream.writer.add_cells(CellType::hexahedron, cube));
  const std::array<Bytes, 1> none{Bytes{}}, whole{Bytes(one)};
  EXPECT_FALSE(stream.writer.add_cells(CellType::hexahedron, cube, {}, none));
  EXPECT_TRUE(stream.writer.add_cells(CellType::hexahedron, cube, {}, whole));
  EXPECT_TRUE(stream.writer.finish());

  Mesh mesh = grid(2, 2, 2);
  mesh.points.bytes.resize(mesh.points.bytes.size() - 3);
  std::vector<std::byte> bytes;
  EXPECT_FALSE(encode(mesh, *memory_sink(bytes), kept()));
}

TEST(BadInput, NumbersThatAreNoneAreKept) {
  Mesh mesh = grid(3, 3, 3);
  const auto numbers = mesh.points.values<float>();
  numbers[4] = std::numeric_limits<float>::quiet_NaN();
  numbers[17] = std::numeric_limits<float>::infinity();
  numbers[33] = -std::numeric_limits<float>::infinity();
  numbers[50] = -0.0f;
  expect_round_trip(mesh);
  EncodeOptions lossy = kept();
  lossy.positions = {Tolerance::Kind::absolute, 0.01};
  const auto back = decode(*memory_source(Bytes(encoded(mesh, lossy))));
  ASSERT_TRUE(back);
  const auto found = back->points.values<float>();
  EXPECT_TRUE(std::isnan(found[4]));
  EXPECT_EQ(found[17], numbers[17]);
  EXPECT_EQ(found[33], numbers[33]);
  for (size_t i = 0; i < found.size(); ++i) {
    if (!std::isfinite(numbers[i])) continue;
    EXPECT_LE(std::abs(double{found[i]} - double{numbers[i]}), 0.01);
  }
}

/// A curve goes through those of no cell: its steps would be infinite here.
TEST(BadInput, PointsALeastDistanceApartAreKept) {
  const double least = std::numeric_limits<double>::denorm_min();
  const std::vector<double> positions = {0, 0, 0, least, 0, -least, 3 * least, 0, 3 * least};
  Mesh mesh;
  mesh.points = make_array("position", Domain::point, Scalar::f64, 3);
  const Bytes bytes = std::as_bytes(std::span(positions));
  mesh.points.bytes.assign(bytes.begin(), bytes.end());
  EncodeOptions options = kept();
  options.order = Order::canonical;
  const auto back = decode(*memory_source(Bytes(encoded(mesh, options))));
  ASSERT_TRUE(back);
  EXPECT_TRUE(compare(mesh, *back).equal);
}

/// A small file whose batch and tail say what they like.
std::vector<std::byte> claiming(const BatchHeader& batch, const StreamTail& tail, size_t bytes) {
  const std::vector<std::byte> honest = encoded(grid(1, 1, 1), kept());
  const auto source = memory_source(Bytes(honest));
  const FileReader file = *FileReader::open(*source);
  std::vector<std::byte> out;
  const auto sink = memory_sink(out);
  FileWriter writer = *FileWriter::begin(*sink, file.header());
  EXPECT_TRUE(writer.write_stream({"DESC"}, *file.read_stream({"DESC"})));
  ByteWriter cells;
  write_batch_header(cells, batch);
  cells.put_bytes(std::vector<std::byte>(bytes, std::byte{0xff}));
  EXPECT_TRUE(writer.write_stream({"CELL"}, cells.bytes()));
  EXPECT_TRUE(writer.write_stream({"POSI"}, std::vector<std::byte>(20, std::byte{0x5a})));
  EXPECT_TRUE(writer.write_stream({"TAIL"}, encode_tail(tail)));
  EXPECT_TRUE(writer.finish());
  return out;
}

TEST(BadInput, CountsThatNoFileCouldHoldAreRefused) {
  for (const uint64_t count : {uint64_t{1} << 25, uint64_t{1} << 26, uint64_t{1} << 33, uint64_t{1} << 60}) {
    BatchHeader batch;
    batch.records = batch.cells = batch.points = count;
    batch.cell_bytes = 40;
    StreamTail tail;
    tail.cells = tail.points = tail.corners = count;
    tail.batches = 1;
    tail.blocks.push_back({"", CellType::hexahedron, count});
    const std::vector<std::byte> file = claiming(batch, tail, 60);
    const auto mesh = decode(*memory_source(Bytes(file)));
    ASSERT_FALSE(mesh) << count;
    EXPECT_EQ(mesh.error().code, ErrorCode::corrupt) << mesh.error().message;
  }
}

}  // namespace
}  // namespace maille
