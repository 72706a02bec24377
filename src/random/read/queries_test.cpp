// Questions to files of mode `random`, answered as the whole mesh would.
#include <gtest/gtest.h>
#include <maille/random_access.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <tuple>

#include "container/testing.h"
#include "random/keep_cells.h"
#include "random/mesh_geometry.h"
#include "support/cases.h"
#include "support/codec.h"
#include "support/random.h"
#include "support/random_file.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

std::vector<double> distances_of_all(const Mesh& mesh, const Vector3& from) {
  std::vector<bool> used(mesh.point_count());
  for (const CellBlock& block : mesh.blocks) {
    for (const uint32_t point : block.connectivity) used[point] = true;
  }
  std::vector<double> distances;
  for (uint64_t i = 0; i < mesh.point_count(); ++i) {
    if (!used[i]) continue;
    const Vector3 d = point_position(mesh.points, i) - from;
    if (std::isfinite(dot(d, d))) distances.push_back(std::sqrt(dot(d, d)));
  }
  std::sort(distances.begin(), distances.end());
  return distances;
}

TEST(NearestPoints, AreThoseOfTheWholeMesh) {
  Random random(5);
  uint64_t found_points = 0;
  for (uint64_t seed = 0; seed < cases(120); ++seed) {
    const Mesh mesh = random_surface(seed, {.faces = 150, .special_values = false});
    const RandomFile file = random_file(mesh, {});
    ASSERT_EQ(file.error, "") << seed;
    const auto source = memory_source(Bytes(file.bytes));
    File open = File::open(*source).value();
    for (unsigned i = 0; i < 6 && mesh.point_count() > 0; ++i) {
      const auto corner = [&] { return point_position(mesh.points, random.below(mesh.point_count())); };
      const Vector3 from = corner() * 1.4 - corner() * 0.4;
      if (!std::isfinite(dot(from, from))) continue;
      const std::vector<double> all = distances_of_all(mesh, from);
      const uint64_t count = 1 + random.below(i == 5 ? 2000 : 12);
      const auto found = open.nearest_points(from, count);
      ASSERT_TRUE(found) << found.error().message;
      ASSERT_EQ(found->size(), std::min<uint64_t>(count, all.size())) << seed << ' ' << i;
      for (size_t k = 0; k < found->size(); ++k) {
        const NearPoint& near = (*found)[k];
        ASSERT_EQ(near.distance, all[k]) << seed << ' ' << i << ' ' << k;
        ++found_points;
      }
      const NearPoint& first = found->empty() ? NearPoint() : found->front();
      if (found->empty()) continue;
      const Vector3 d = point_position(open.read(first.chart)->points, first.point) - first.position;
      EXPECT_EQ(dot(d, d), 0) << seed;
    }
  }
  EXPECT_GE(found_points, cases(2000));
}

TEST(NearestPoints, ReadOnlyWhatIsNear) {
  const Mesh mesh = to_mesh(triangulated(shapes::sphere(120, 80)));
  const RandomFile file = random_file(mesh, {}, 128);
  const RemoteSource source(file.bytes);
  File open = File::open(source).value();
  const uint64_t before = source.bytes_read();
  const auto found = open.nearest_points({{8, 7, 6}}, 10);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->size(), 10u);
  EXPECT_LE(source.bytes_read() - before, source.size() / 10);
}

/// Cells by what they hang together with: the lowest point of it.
std::vector<uint32_t> lowest_points(const Mesh& mesh) {
  std::vector<uint32_t> parent(mesh.point_count());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto find = [&](uint32_t p) {
    while (parent[p] != p) p = parent[p];
    return p;
  };
  const auto for_each_cell = [&](auto f) {
    for (const CellBlock& block : mesh.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i) f(block.cell(i));
    }
  };
  for_each_cell([&](auto cell) {
    for (const uint32_t p : cell) {
      const uint32_t a = find(cell[0]), b = find(p);
      parent[std::max(a, b)] = std::min(a, b);
    }
  });
  std::vector<uint32_t> lowest;
  for_each_cell([&](auto cell) { lowest.push_back(cell.empty() ? max_points : find(cell[0])); });
  return lowest;
}

/// All components of a mesh, each as a mesh of its own.
std::vector<Mesh> components_of(const Mesh& mesh) {
  const std::vector<uint32_t> lowest = lowest_points(mesh);
  std::vector<uint32_t> numbers = lowest;
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  std::vector<Mesh> components;
  for (const uint32_t number : numbers) {
    if (number == max_points) continue;
    std::vector<bool> keep;
    for (const uint32_t of_cell : lowest) keep.push_back(of_cell == number);
    components.push_back(keep_cells(mesh, keep));
  }
  return components;
}

/// Asks for the component of each cell that is in none yet; each must be one of the mesh, and each of the
/// mesh be found.
std::string components_differ(const Mesh& mesh, const RandomFile& file) {
  const auto source = memory_source(Bytes(file.bytes));
  auto open = File::open(*source);
  if (!open) return open.error().message;
  std::vector<Mesh> expected = components_of(mesh);
  std::set<std::tuple<uint32_t, uint32_t, uint32_t>> known;
  const Selection all = open->select({}, Detail::full()).value();
  for (const ChartPlace& place : all.charts) {
    const Mesh chart = open->read(place).value();
    uint32_t number = 0;
    for (const CellBlock& block : chart.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i, ++number) {
        if (block.cell(i).empty() || known.count({place.group, place.chart, number})) continue;
        const auto component = open->component(place, block.cell(i)[0]);
        if (!component) return component.error().message;
        for (const Component::Part& part : component->parts) {
          for (const uint32_t cell : part.cells) {
            if (!known.insert({part.chart.group, part.chart.chart, cell}).second)
              return "a cell of two components";
          }
        }
        const Mesh extracted = open->extract(*component).value();
        if (extracted.cell_count() != component->cells) return "another number of cells than said";
        const auto same = std::find_if(expected.begin(), expected.end(), [&](const Mesh& m) {
          return m.cell_count() == extracted.cell_count() && differences_between(m, extracted).empty();
        });
        if (same == expected.end()) return "a component that the mesh has not";
        expected.erase(same);
      }
    }
  }
  return expected.empty() ? "" : "components that were not found";
}

TEST(Components, AreThoseOfTheWholeMesh) {
  for (uint64_t seed = 0; seed < cases(100); ++seed) {
    RandomMeshOptions options;
    options.faces = 120;
    options.other_cells = seed % 4 == 0;
    const Mesh mesh = random_surface(seed, options);
    const RandomFile file = random_file(mesh, {});
    if (file.unsupported) continue;
    ASSERT_EQ(file.error, "") << seed;
    ASSERT_EQ(components_differ(mesh, file), "") << seed;
  }
}

TEST(Components, ReachThroughManyChartsAndLeaveOthersAlone) {
  Surface balls;
  const Surface ball = triangulated(shapes::sphere(40, 30));
  for (const double x : {0.0, 30.0, 60.0, 90.0}) append(balls, ball, {x, 0, 0});
  const Mesh mesh = to_mesh(balls);
  const RandomFile file = random_file(mesh, {}, 64);
  ASSERT_EQ(components_differ(mesh, file), "");
  const RemoteSource source(file.bytes);
  File open = File::open(source).value();
  const uint64_t before = source.bytes_read();
  const auto start = open.nearest({{110, 0, 0}}).value();
  const auto component = open.component(start->chart, start->corners[0]).value();
  EXPECT_EQ(component.cells, mesh.cell_count() / 4);
  EXPECT_GE(component.parts.size(), 20u);
  EXPECT_LE(source.bytes_read() - before, source.size() / 2);
}

TEST(Components, AreNotThoseOfChartsThatAreNotThere) {
  const RandomFile file = random_file(to_mesh(triangulated(shapes::sphere(30, 20))), {}, 64);
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  EXPECT_EQ(open.component({0, 1000}, 0).error().code, ErrorCode::usage);
  EXPECT_EQ(open.component({0, 0}, 0).error().code, ErrorCode::usage) << "a coarse chart";
  const ChartPlace place = open.select({}, Detail::full()).value().charts[0];
  EXPECT_EQ(open.component(place, 100000).error().code, ErrorCode::usage);
  Component hostile;
  hostile.parts.push_back({place, {5, 3, 1000000}});
  const auto mesh = open.extract(hostile);
  ASSERT_TRUE(mesh);
  EXPECT_TRUE(validate(*mesh));
}

/// As they are promised.
std::string wrong_meshlets(const Mesh& mesh, const Meshlets& found) {
  std::vector<std::array<uint32_t, 4>> expected, given;
  uint32_t face = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i, ++face) {
      if (!is_face(block.type_of(i))) continue;
      for_each_fan_triangle(mesh.points, block.cell(i), [&](uint32_t a, uint32_t b, uint32_t c) {
        expected.push_back({face, a, b, c});
      });
    }
  }
  size_t point = 0, triangle = 0;
  for (const Meshlets::Piece& piece : found.pieces) {
    if (piece.first_point != point || piece.first_triangle != triangle) return "pieces with gaps";
    if (piece.points > 64 || piece.triangles > 124 || piece.triangles == 0) return "a piece of a wrong size";
    for (uint32_t t = 0; t < piece.triangles; ++t, ++triangle) {
      std::array<uint32_t, 4> corners{found.faces[triangle]};
      for (size_t k = 0; k < 3; ++k) {
        const uint8_t place = found.corners[3 * triangle + k];
        if (place >= piece.points) return "a corner beyond the piece";
        corners[k + 1] = found.points[point + place];
      }
      given.push_back(corners);
    }
    std::vector<uint32_t> points(found.points.begin() + static_cast<ptrdiff_t>(point),
                                 found.points.begin() + static_cast<ptrdiff_t>(point + piece.points));
    std::sort(points.begin(), points.end());
    if (std::adjacent_find(points.begin(), points.end()) != points.end()) return "a point twice";
    point += piece.points;
  }
  std::sort(expected.begin(), expected.end());
  std::sort(given.begin(), given.end());
  if (point != found.points.size() || 3 * triangle != found.corners.size())
    return "more than the pieces have";
  return expected == given ? "" : "other triangles";
}

TEST(Meshlets, HaveEveryTriangleOnceWithinTheirLimits) {
  for (uint64_t seed = 0; seed < cases(400); ++seed) {
    RandomMeshOptions options;
    options.faces = 400;
    options.other_cells = true;
    const Mesh mesh = random_surface(seed, options);
    ASSERT_EQ(wrong_meshlets(mesh, meshlets(mesh)), "") << seed;
  }
}

TEST(Meshlets, AreNearlyFull) {
  const Mesh mesh = to_mesh(triangulated(shapes::sphere(200, 100)));
  const RandomFile file = random_file(mesh, {}, 4096);
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  size_t pieces = 0;
  const Selection all = open.select({}, Detail::full()).value();
  for (const ChartPlace& place : all.charts) pieces += meshlets(open.read(place).value()).pieces.size();
  // 64 points of a regular surface have at most 98 triangles between them.
  EXPECT_GE(mesh.cell_count() / pieces, 80u);
}

}  // namespace
}  // namespace maille::testing
