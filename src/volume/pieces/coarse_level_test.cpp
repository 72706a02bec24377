#include "volume/pieces/coarse_level.h"

#include <maille/volume_file.h>

#include <algorithm>
#include <cmath>

#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

/// 2 x - y + 3 z of a place.
double linear(double x, double y, double z) {
  return 2 * x - y + 3 * z;
}

/// A grid with a linear field on its points, and the same of cells' middles on its cells.
Mesh with_linear_fields(Mesh mesh) {
  Array points = make_array("T", Domain::point, Scalar::f64, 1);
  points.resize(mesh.point_count());
  const auto at = mesh.points.values<float>();
  for (size_t i = 0; i < mesh.point_count(); ++i)
    points.values<double>()[i] = linear(static_cast<double>(at[3 * i]), static_cast<double>(at[3 * i + 1]),
                                        static_cast<double>(at[3 * i + 2]));
  Array cells = make_array("mean", Domain::cell, Scalar::f32, 1);
  cells.resize(mesh.cell_count());
  for (uint64_t c = 0; c < mesh.cell_count(); ++c) {
    double sum = 0;
    for (const uint32_t point : mesh.blocks[0].cell(c)) sum += points.values<double>()[point];
    cells.values<float>()[c] = static_cast<float>(sum / 8);
  }
  mesh.arrays = {std::move(points), std::move(cells)};
  return mesh;
}

void expect_linear(const Mesh& coarse, double tolerance) {
  const auto at = coarse.points.values<float>();
  ASSERT_EQ(coarse.arrays.size(), 2U);
  for (size_t i = 0; i < coarse.point_count(); ++i) {
    const double value = linear(static_cast<double>(at[3 * i]), static_cast<double>(at[3 * i + 1]),
                                static_cast<double>(at[3 * i + 2]));
    for (const Array& array : coarse.arrays)
      EXPECT_NEAR(static_cast<double>(array.values<float>()[i]), value, tolerance) << array.name;
  }
}

std::vector<std::byte> in_pieces(const Mesh& mesh, uint64_t cells) {
  EncodeOptions options = kept(2);
  options.most_cells_per_part = cells;
  return encoded(mesh, options);
}

Result<Mesh> coarse_of(const std::vector<std::byte>& file, const DecodeOptions& options = {}) {
  const auto source = memory_source(Bytes(file));
  return VolumeFile::open(*source, options)->coarse();
}

TEST(CoarseLevel, PointsAreMiddlesOfGroupsWithTheMeansOfTheirValues) {
  const Mesh mesh = with_linear_fields(grid(40, 30, 20));
  const Mesh coarse = *coarse_of(in_pieces(mesh, 4096));
  EXPECT_GE(coarse.point_count(), 40U * 30 * 20 / 4096);
  EXPECT_EQ(coarse.cell_count(), coarse.point_count());
  double largest = 0;
  for (const double value : mesh.arrays[0].values<double>()) largest = std::max(largest, std::abs(value));
  expect_linear(coarse, 6 * largest / 250);
}

TEST(CoarseLevel, GroupsAreAsSmallAsAskedFor) {
  const Mesh mesh = with_linear_fields(grid(12, 9, 7));
  PieceRecord record;
  record.cells = mesh.cell_count();
  enclose(mesh.points, {}, record);
  for (const Array& array : mesh.arrays) record.fields.push_back(describe_field(array, {}));
  add_coarse_points(mesh, 40, record);
  EXPECT_GT(record.coarse.size() / 3, 12U * 9 * 7 / 60);
  EXPECT_EQ(record.fields[1].coarse.size(), record.coarse.size() / 3);
}

TEST(CoarseLevel, ValuesThatAreNotFiniteDoNotCount) {
  Mesh mesh = with_linear_fields(grid(4, 4, 4));
  const auto values = mesh.arrays[1].values<float>();
  std::fill(values.begin(), values.end(), std::nanf(""));
  EXPECT_TRUE(std::isnan(coarse_of(in_pieces(mesh, 1000))->arrays[1].values<float>()[0]));
  values[5] = 7;
  EXPECT_EQ(coarse_of(in_pieces(mesh, 1000))->arrays[1].values<float>()[0], 7);
}

TEST(CoarseLevel, OnlyArraysThatAreWantedCome) {
  DecodeOptions options;
  options.arrays = {"mean"};
  const Mesh coarse = *coarse_of(in_pieces(with_linear_fields(grid(4, 4, 4)), 1000), options);
  ASSERT_EQ(coarse.arrays.size(), 1U);
  EXPECT_EQ(coarse.arrays[0].name, "mean");
}

TEST(CoarseLevel, AFileThatIsNotInPiecesSaysThatItHasNone) {
  const auto coarse = coarse_of(encoded(grid(3, 3, 3), kept(2)));
  ASSERT_FALSE(coarse);
  EXPECT_EQ(coarse.error().code, ErrorCode::unsupported);
}

}  // namespace
}  // namespace maille
