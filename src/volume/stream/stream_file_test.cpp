#include "volume/stream/stream_file.h"
#include "support/cases.h"

#include <maille/file.h>

#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

TEST(StreamFile, KeepsGridsOfEverySize) {
  for (unsigned n = 0; n < 5; ++n) expect_round_trip(grid(n, n, n));
  expect_round_trip(grid(1, 1, 1));
  expect_round_trip(grid(40, 30, 20));
  expect_round_trip(grid(40, 30, 20), 1);
}

TEST(StreamFile, KeepsMeshesWithoutCellsOrPoints) {
  expect_round_trip(Mesh{});
  Mesh points;
  set_positions(points, std::vector<float>(3 * 20000, 1.5f));
  expect_round_trip(points);
}

TEST(StreamFile, CostsNextToNothingForStructuredCells) {
  const Mesh mesh = grid(50, 50, 40);
  std::vector<std::byte> bytes;
  const auto report = encode(mesh, *memory_sink(bytes), kept());
  ASSERT_TRUE(report);
  const double cells = static_cast<double>(mesh.cell_count());
  EXPECT_LT(static_cast<double>(report->connectivity.coded_bytes) * 8 / cells, 0.02);
  EXPECT_LT(static_cast<double>(report->order_bytes) * 8 / cells, 0.01);
}

RC_GTEST_PROP(StreamFile, KeepsAnySoupOfCells, ()) {
  const auto seed = *rc::gen::arbitrary<unsigned>();
  const auto cells = *rc::gen::inRange(1u, 300u);
  const auto points = *rc::gen::inRange(1u, 120u);
  const int effort = *rc::gen::element(1, 5);
  Mesh mesh = soup(seed, cells, points);
  const std::vector<std::byte> bytes = encoded(mesh, kept(effort));
  const auto back = decode(*memory_source(Bytes(bytes)));
  RC_ASSERT(back.has_value());
  RC_ASSERT(back->blocks[0].connectivity == mesh.blocks[0].connectivity);
  RC_ASSERT(back->blocks[0].types == mesh.blocks[0].types);
  RC_ASSERT(back->blocks[0].offsets == mesh.blocks[0].offsets);
  RC_ASSERT(back->points.bytes == mesh.points.bytes);
}

// A corner that repeats a new one has no value yet when that one is predicted.
TEST(StreamFile, KeepsCellsThatRepeatNewCorners) {
  Mesh mesh = grid(1, 1, 40);
  CellBlock& block = mesh.blocks[0];
  for (size_t i = 0; i < block.connectivity.size(); i += 8) {
    block.connectivity[i + 5] = block.connectivity[i + 4];
    block.connectivity[i + 7] = block.connectivity[i + 6];
  }
  expect_round_trip(mesh);
}

TEST(StreamFile, KeepsArraysOfEveryTypeBitForBit) {
  Mesh mesh = soup(7, 500, 200);
  add_arrays(mesh, 3);
  expect_round_trip(mesh);
  Mesh regular = grid(9, 8, 7);
  add_arrays(regular, 4);
  expect_round_trip(regular);
}

TEST(StreamFile, KeepsBlocksNamesAndEmptyBlocks) {
  Mesh mesh = grid(3, 3, 3);
  CellBlock sides;
  sides.name = "sides";
  sides.type = CellType::polygon;
  sides.offsets = {0, 4, 7, 12};
  sides.connectivity = {0, 1, 5, 4, 1, 2, 5, 8, 9, 10, 11, 12};
  CellBlock empty;
  empty.name = "empty";
  empty.type = CellType::wedge;
  mesh.blocks = {empty, sides, mesh.blocks[0], empty};
  expect_round_trip(mesh);
}

TEST(StreamFile, AnyOrderIsTheSameMesh) {
  Mesh mesh = grid(6, 5, 4);
  std::vector<uint32_t> shuffled(mesh.point_count());
  std::iota(shuffled.begin(), shuffled.end(), 0u);
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(5));
  for (uint32_t& point : mesh.blocks[0].connectivity) point = shuffled[point];
  EncodeOptions options = kept();
  options.order = Order::canonical;
  const auto back = decode(*memory_source(encoded(mesh, options)));
  ASSERT_TRUE(back) << back.error().message;
  const Comparison comparison = compare(mesh, *back);
  EXPECT_TRUE(comparison.equal) << comparison.differences.front();
}

TEST(StreamFile, KeepsErrorBounds) {
  Mesh mesh = grid(12, 11, 10);
  mesh.points.values<float>()[5] = std::numeric_limits<float>::infinity();
  EncodeOptions options = kept();
  options.positions = {Tolerance::Kind::absolute, 0.003};
  const auto back = decode(*memory_source(encoded(mesh, options)));
  ASSERT_TRUE(back) << back.error().message;
  for (size_t i = 0; i < mesh.points.values<float>().size(); ++i) {
    const float a = mesh.points.values<float>()[i], b = back->points.values<float>()[i];
    if (a != b) {
      EXPECT_LE(std::abs(static_cast<double>(a) - static_cast<double>(b)), 0.003) << i;
    }
  }
}

TEST(StreamFile, RefusesWhatAStreamCannotHold) {
  Mesh mesh = grid(2, 2, 2);
  Array corner = make_array("uv", Domain::corner, Scalar::f32, 2);
  corner.resize(mesh.corner_count());
  mesh.arrays.push_back(corner);
  std::vector<std::byte> bytes;
  const auto report = encode(mesh, *memory_sink(bytes), kept());
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::unsupported);
}

TEST(StreamFile, IsDescribedWithoutDecoding) {
  Mesh mesh = grid(4, 4, 4);
  add_arrays(mesh, 1);
  const auto info = inspect(*memory_source(encoded(mesh, kept())));
  ASSERT_TRUE(info) << info.error().message;
  EXPECT_EQ(info->mode, Mode::stream);
  EXPECT_EQ(info->points, mesh.point_count());
  EXPECT_EQ(info->cells, mesh.cell_count());
  EXPECT_EQ(info->blocks.size(), 1u);
  EXPECT_EQ(info->arrays.size(), 20u);
}

TEST(StreamFile, EveryTruncationIsRefused) {
  Mesh mesh = soup(3, 60, 40);
  const std::vector<std::byte> bytes = encoded(mesh, kept());
  for (size_t size = 0; size < bytes.size(); size += every(1)) {
    const auto back = decode(*memory_source(Bytes(bytes).first(size)));
    ASSERT_FALSE(back) << size;
  }
}

}  // namespace
}  // namespace maille
