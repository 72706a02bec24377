#include "volume/stream/stream_file.h"
#include "support/cases.h"

#include <maille/file.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "numbers/float_bits.h"
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

Array widened(const Array& array) {
  if (array.type != Scalar::f32) return array;
  Array wide = make_array(array.name, array.domain, Scalar::f64, array.components);
  wide.resize(array.count());
  const auto from = array.values<float>();
  const auto to = wide.values<double>();
  for (size_t i = 0; i < from.size(); ++i) store(&to[i], widened_bits(bits_as<uint32_t>(from[i])));
  return wide;
}

/// A grid with noise, a smooth field, one of decimals, and one with numbers that are none.
Mesh with_fields_of_floats() {
  Mesh mesh = grid(20, 20, 20);
  std::mt19937 random(5);
  const auto noise = [&] { return static_cast<float>(random() % 1000) * 1e-6F; };
  const auto positions = mesh.points.values<float>();
  for (float& x : positions) x += noise();
  const auto add_field = [&](const char* name, auto value_at) {
    Array field = make_array(name, Domain::point, Scalar::f32, 1);
    field.resize(mesh.point_count());
    for (size_t i = 0; i < field.count(); ++i) field.values<float>()[i] = value_at(i);
    mesh.arrays.push_back(std::move(field));
  };
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const float odd[] = {std::numeric_limits<float>::quiet_NaN(), infinity, -infinity, -0.0F};
  add_field("smooth", [&](size_t i) { return positions[3 * i] * positions[3 * i + 1] + noise(); });
  add_field("decimals", [&](size_t i) { return std::round(positions[3 * i] * 1e3F) / 1e3F; });
  add_field("odd", [&](size_t i) { return i % 97 < 4 ? odd[i % 97] : positions[3 * i]; });
  return mesh;
}

TEST(StreamFile, DoublesThatHoldFloatsTakeWhatTheFloatsTake) {
  const Mesh narrow = with_fields_of_floats();
  Mesh wide = narrow;
  wide.points = widened(narrow.points);
  for (Array& array : wide.arrays) array = widened(array);
  for (const int effort : {2, 5}) {
    const auto floats = static_cast<double>(encoded(narrow, kept(effort)).size());
    EXPECT_LE(static_cast<double>(encoded(wide, kept(effort)).size()), 1.003 * floats) << effort;
    expect_round_trip(wide, effort);
  }
}

TEST(StreamFile, KeepsDoublesAmongOthersThatAreFloats) {
  Mesh mesh = with_fields_of_floats();
  for (Array& array : mesh.arrays) {
    array = widened(array);
    const auto numbers = array.values<double>();
    numbers[17] = 0.1;
    numbers[18] = 1e300;
    numbers[19] = std::numeric_limits<double>::denorm_min();
    numbers[20] = bits_as<double>(uint64_t{0xfff8000000000001});  // a NaN with bits beyond those of a float
    numbers[21] = bits_as<double>(uint64_t{0x7ff0000000000001});  // one that as a float were infinite
  }
  expect_round_trip(mesh);
  expect_round_trip(mesh, 1);
}

/// Tetrahedra over points in no order, whose coordinates, and a field of cells, are of a few numbers each.
Mesh of_few_numbers() {
  Mesh mesh = soup(11, 3000, 4000);
  std::mt19937 random(12);
  std::vector<double> few(40);
  for (double& number : few) number = static_cast<double>(random()) / 4294967296.0 - 0.5;
  few[0] = 0.0;
  few[1] = -0.0;
  const auto fill = [&](Array& array) {
    for (double& number : array.values<double>()) number = few[random() % few.size()];
  };
  mesh.points = make_array("position", Domain::point, Scalar::f64, 3);
  mesh.points.resize(4000);
  fill(mesh.points);
  Array field = make_array("density", Domain::cell, Scalar::f64, 1);
  field.resize(mesh.cell_count());
  fill(field);
  mesh.arrays.push_back(std::move(field));
  return mesh;
}

TEST(StreamFile, DoublesThatComeAgainTakeARankInATable) {
  Mesh mesh = of_few_numbers();
  for (const int effort : {2, 5}) {
    std::vector<std::byte> bytes;
    const auto report = encode(mesh, *memory_sink(bytes), kept(effort));
    ASSERT_TRUE(report);
    EXPECT_LT(report->positions.coded_bytes, 12000u) << "a byte for each number";
    EXPECT_LT(report->arrays[0].coded_bytes, 3000u);
    expect_round_trip(mesh, effort);
  }
  // As floats, and doubles that hold floats.
  const auto narrow = [](Array& array) {
    for (double& number : array.values<double>()) number = static_cast<float>(number);
  };
  narrow(mesh.points);
  narrow(mesh.arrays[0]);
  expect_round_trip(mesh);
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

// A mesh without cells has no pieces, and once was written with an array on corners that no decoder took.
TEST(StreamFile, RefusesWhatAStreamCannotHold) {
  Mesh without_cells;
  without_cells.points = make_array("position", Domain::point, Scalar::f32, 3);
  for (Mesh mesh : {grid(2, 2, 2), without_cells}) {
    Array corner = make_array("uv", Domain::corner, Scalar::f32, 2);
    corner.resize(mesh.corner_count());
    mesh.arrays.push_back(corner);
    for (const std::optional<uint64_t> cells_of_piece :
         {std::optional<uint64_t>(), std::optional<uint64_t>(3)}) {
      EncodeOptions options = kept();
      options.most_cells_per_part = cells_of_piece;
      std::vector<std::byte> bytes;
      const auto report = encode(mesh, *memory_sink(bytes), options);
      ASSERT_FALSE(report);
      EXPECT_EQ(report.error().code, ErrorCode::unsupported);
    }
  }
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
