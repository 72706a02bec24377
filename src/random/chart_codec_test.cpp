#include "random/chart_codec.h"

#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <set>

#include "support/coded_mesh.h"
#include "support/half_edges.h"
#include "support/random_mesh.h"
#include "surface/mesh_description.h"

namespace maille::testing {
namespace {

/// A chart that is a whole mesh, with these points shared.
struct Chart {
  ChartSet set;
  std::vector<std::byte> bytes;
  Mesh mesh;
  EncodedPatch patch;
};

Chart chart_of(const Surface& shape, int effort) {
  Chart chart;
  chart.mesh = to_mesh(shape);
  chart.mesh.points = smooth(shape, 1);
  EncodeOptions options;
  options.effort = effort;
  const std::vector<ArrayToCode> arrays{{&chart.mesh.points, *choose_maps(chart.mesh.points, {}, true)}};
  PartNumbers numbers;
  numbers.points.resize(chart.mesh.point_count());
  numbers.cells.resize(chart.mesh.cell_count());
  std::iota(numbers.points.begin(), numbers.points.end(), 0u);
  std::iota(numbers.cells.begin(), numbers.cells.end(), 0u);
  numbers.first_corner = table_cells(chart.mesh).corner;
  SharedFanEncoder shared;
  EXPECT_TRUE(shared.add(chart.mesh, numbers.points, chart.mesh.points));
  const std::vector<std::byte> tables = shared.finish(arrays[0].maps, effort, range_of_codes(arrays[0]));
  chart.patch = *encode_chart(chart.mesh, numbers, arrays, options, shared);
  chart.set = *chart_set(describe(chart.mesh, arrays, options), 0, tables);
  return chart;
}

std::vector<std::byte> bytes_of(const Chart& chart, std::span<const SharedPoint> shared) {
  return chart_bytes(counts_of({chart.mesh, {0}, {}}), 1, chart.patch, shared);
}

std::vector<SharedPoint> decoded_points(const Chart& chart, const std::vector<SharedPoint>& shared) {
  const std::vector<std::byte> bytes = bytes_of(chart, shared);
  const auto decoded = decode_chart(chart.set, bytes, {});
  EXPECT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(decoded->mesh.point_count(), chart.mesh.point_count());
  EXPECT_EQ(decoded->mesh.cell_count(), chart.mesh.cell_count());
  return decoded->shared;
}

TEST(ChartCodec, AnySharedPointsComeBack) {
  for (const Surface& shape : {triangulated(shapes::grid(9, 7)), shapes::grid(9, 7), shapes::book(4)}) {
    for (const int effort : {2, 5}) {
      const Chart chart = chart_of(shape, effort);
      for (uint64_t seed = 0; seed < 40; ++seed) {
        Random random(seed);
        std::vector<SharedPoint> shared;
        for (uint32_t i = 0; i < shape.points.size(); ++i) {
          if (random.below(seed % 5 + 1) == 0) shared.push_back({i, random.below(3) * random.below(2)});
        }
        const auto decoded = decoded_points(chart, shared);
        ASSERT_EQ(decoded.size(), shared.size());
        for (size_t i = 0; i < shared.size(); ++i) {
          EXPECT_EQ(decoded[i].point, shared[i].point);
          EXPECT_EQ(decoded[i].copy, shared[i].copy);
        }
      }
    }
  }
}

TEST(ChartCodec, PointsOnTheBorderAreSharedForOneByte) {
  const Chart chart = chart_of(triangulated(shapes::grid(20, 20)), 2);
  std::map<std::pair<uint32_t, uint32_t>, int> sides;
  const Buffer<uint32_t>& corners = chart.mesh.blocks[0].connectivity;
  for (size_t i = 0; i < corners.size(); ++i) {
    const uint32_t next = corners[i % 3 == 2 ? i - 2 : i + 1];
    ++sides[std::minmax(corners[i], next)];
  }
  std::set<uint32_t> on_border;
  for (const auto& [side, count] : sides) {
    if (count == 1) on_border.insert({side.first, side.second});
  }
  std::vector<SharedPoint> border;
  const std::vector<uint32_t>& points = chart.patch.sources.points;
  for (uint32_t i = 0; i < points.size(); ++i) {
    if (on_border.count(points[i]) > 0) border.push_back({i, 0});
  }
  ASSERT_EQ(border.size(), 80);
  const size_t streams = chart.patch.topology.bytes.size() + chart.patch.arrays[0].bytes.size();
  // Points, cells and corners take two bytes each, the codings and the size of the topology one.
  EXPECT_LE(bytes_of(chart, border).size(), streams + 1 + 8);
  EXPECT_EQ(decoded_points(chart, border).size(), border.size());
}

TEST(ChartCodec, DamageIsAnErrorOrAValidMesh) {
  std::vector<Chart> charts;
  charts.push_back(chart_of(triangulated(shapes::grid(9, 7)), 2));
  charts.push_back(chart_of(shapes::grid(9, 7), 2));
  charts.push_back(chart_of(triangulated(shapes::torus(12, 9)), 5));
  for (uint64_t seed = 0; seed < 3000 && !HasFailure(); ++seed) {
    Random random(seed);
    const Chart& chart = charts[seed % charts.size()];
    const std::vector<SharedPoint> shared{{0, 1}, {3, 0}, {5, 2}};
    const auto decoded = decode_chart(chart.set, damaged(bytes_of(chart, shared), random), {});
    if (!decoded) continue;
    EXPECT_TRUE(validate(decoded->mesh));
    for (const SharedPoint& point : decoded->shared) EXPECT_LT(point.point, decoded->mesh.point_count());
  }
}

TEST(ChartCodec, FansWithoutTheTablesOfTheFileAreAnError) {
  Chart chart = chart_of(triangulated(shapes::grid(9, 7)), 2);
  const auto bytes = bytes_of(chart, std::span<const SharedPoint>());
  chart.set.tables = {};
  const auto decoded = decode_chart(chart.set, bytes, {});
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
}

}  // namespace
}  // namespace maille::testing
