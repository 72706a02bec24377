// Files of mode `random` that were built a window at a time.
#include <gtest/gtest.h>
#include <maille/io.h>
#include <maille/random_access.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "mesh/mesh_as_source.h"
#include "random/random_file.h"
#include "support/cases.h"
#include "support/codec.h"
#include "support/random.h"
#include "support/random_file.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

SourceBuilding small_windows(uint64_t faces, uint32_t chart_faces = 16) {
  SourceBuilding building;
  building.sizes = {chart_faces, chart_faces};
  building.window_faces = faces;
  building.space.memory = uint64_t{1} << 30;
  return building;
}

RandomFile file_in_parts(const Mesh& mesh, const SourceBuilding& building, EncodeOptions options = {}) {
  RandomFile file;
  options.mode = Mode::random;
  const auto source_in_memory = mesh_as_source(mesh);
  MeshSource& source = *source_in_memory;
  const auto sink = memory_sink(file.bytes);
  const auto report = encode_random(source, *sink, options, building);
  if (report) {
    EXPECT_EQ(report->file_bytes, file.bytes.size());
    return file;
  }
  file.error = report.error().message;
  file.unsupported = report.error().code == ErrorCode::unsupported;
  return file;
}

std::string round_trip_in_parts(Mesh mesh, const SourceBuilding& building,
                                const EncodeOptions& options = {}) {
  // Sources have none.
  const auto of_corners = [](const Array& array) { return array.domain == Domain::corner; };
  std::erase_if(mesh.arrays, of_corners);
  const RandomFile file = file_in_parts(mesh, building, options);
  if (file.unsupported) return "";
  if (!file.error.empty()) return file.error;
  const auto decoded = decode_bytes(file.bytes);
  if (!decoded) return decoded.error().message;
  const bool same_order = options.order == Order::keep;
  return differences_between(mesh, *decoded, same_order);
}

Mesh rough_sphere(uint32_t n, uint64_t seed = 1) {
  Mesh mesh = to_mesh(triangulated(shapes::sphere(n, n)));
  Random random(seed);
  for (float& x : mesh.points.values<float>()) x *= static_cast<float>(1 + 0.001 * random.unit());
  return mesh;
}

/// Each triangle with points of its own.
Mesh unwelded(const Mesh& mesh) {
  Mesh soup;
  soup.points = make_array("position", Domain::point, Scalar::f32, 3);
  CellBlock& block = soup.blocks.emplace_back();
  block.type = CellType::triangle;
  for (const uint32_t v : mesh.blocks[0].connectivity) {
    block.connectivity.push_back(static_cast<uint32_t>(block.connectivity.size()));
    soup.points.bytes.insert(soup.points.bytes.end(), mesh.points.bytes.begin() + 12 * v,
                             mesh.points.bytes.begin() + 12 * (v + 1));
  }
  return soup;
}

TEST(RandomSource, GivesRandomSurfacesBack) {
  RandomMeshOptions meshes;
  meshes.faces = 200;
  meshes.several_blocks = false;
  EXPECT_EQ(
      check_random_surfaces(1, 300, meshes,
                            [](const Mesh& mesh) { return round_trip_in_parts(mesh, small_windows(40)); }),
      "");
}

TEST(RandomSource, GivesPointsBackWithAnEmptyBlockAndWithNone) {
  Mesh mesh = rough_sphere(12);
  mesh.blocks.clear();
  EXPECT_EQ(round_trip_in_parts(mesh, small_windows(40)), "");
  EXPECT_EQ(round_trip(mesh, {}), "");
  mesh.blocks.emplace_back().type = CellType::triangle;
  EXPECT_EQ(round_trip_in_parts(mesh, small_windows(40)), "");
  EXPECT_EQ(round_trip(mesh, {}), "");
}

TEST(RandomSource, GivesSurfacesBackAtEveryEffort) {
  for (const int effort : {1, 2, 5, 7}) {
    EncodeOptions options;
    options.effort = effort;
    EXPECT_EQ(round_trip_in_parts(rough_sphere(large(40)), small_windows(large(300)), options), "") << effort;
  }
}

TEST(RandomSource, KeepsTheOrder) {
  RandomMeshOptions meshes;
  meshes.faces = 200;
  meshes.several_blocks = false;
  EncodeOptions options;
  options.order = Order::keep;
  const auto round_trip = [&](const Mesh& mesh) {
    return round_trip_in_parts(mesh, small_windows(40), options);
  };
  EXPECT_EQ(check_random_surfaces(2, 200, meshes, round_trip), "");
  EXPECT_EQ(round_trip_in_parts(unwelded(rough_sphere(large(40))), small_windows(large(200)), options), "");
}

TEST(RandomSource, TellsPointsAtOnePlaceApart) {
  // On a coarse lattice many points of one window lie at a place, some of them on the borders of charts.
  EncodeOptions options;
  options.positions = {Tolerance::Kind::bits, 4};
  const Mesh mesh = rough_sphere(large(40));
  const RandomFile in_parts = file_in_parts(mesh, small_windows(large(200)), options);
  ASSERT_EQ(in_parts.error, "");
  const RandomFile whole = random_file(mesh, options, 16);
  EXPECT_EQ(differences_between(decode_bytes(whole.bytes).value(), decode_bytes(in_parts.bytes).value()), "");
  EXPECT_EQ(round_trip_in_parts(unwelded(mesh), small_windows(large(200))), "");
}

TEST(RandomSource, KeepsABoundForNumbersThatNoSampleHas) {
  Mesh mesh = rough_sphere(260);  // a few more points than a sample has
  // One number in a hundred thousand with more digits than all others.
  const auto numbers = mesh.points.values<float>();
  for (float& x : numbers) x = std::round(x * 1024) / 1024;
  numbers[numbers.size() / 2 + 1] = 0.1f;
  const RandomFile exact = file_in_parts(mesh, small_windows(50000, 2048));
  ASSERT_EQ(exact.error, "");
  EXPECT_EQ(differences_between(mesh, decode_bytes(exact.bytes).value()), "");
  EncodeOptions options;
  options.positions = {Tolerance::Kind::absolute, 0.001};
  const RandomFile file = file_in_parts(mesh, small_windows(50000, 2048), options);
  ASSERT_EQ(file.error, "");
  EXPECT_LT(file.bytes.size(), exact.bytes.size());
}

TEST(RandomSource, IsTheSameForAnyNumberOfThreadsAndAnyMemory) {
  const auto threads = thread_executor(3);
  const Mesh mesh = rough_sphere(large(60));
  EncodeOptions options;
  options.order = Order::keep;
  const RandomFile serial = file_in_parts(mesh, small_windows(large(500)), options);
  ASSERT_EQ(serial.error, "");
  options.executor = threads.get();
  EXPECT_TRUE(serial.bytes == file_in_parts(mesh, small_windows(large(500)), options).bytes);
  SourceBuilding little = small_windows(large(500));
  little.space.memory = uint64_t{97} << 20;
  EXPECT_TRUE(serial.bytes == file_in_parts(mesh, little, options).bytes);
}

/// Edges of an odd number of triangles, by the positions of their ends.
std::set<std::array<float, 6>> odd_edges(const Mesh& mesh) {
  std::set<std::array<float, 6>> odd;
  const auto positions = mesh.points.values<float>();
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto nodes = block.cell(i);
      for (size_t k = 0; k < nodes.size(); ++k) {
        std::array<std::array<float, 3>, 2> ends;
        for (size_t x = 0; x < 3; ++x) {
          ends[0][x] = positions[size_t{3} * nodes[k] + x];
          ends[1][x] = positions[size_t{3} * nodes[(k + 1) % nodes.size()] + x];
        }
        std::sort(ends.begin(), ends.end());
        const std::array<float, 6> edge{ends[0][0], ends[0][1], ends[0][2],
                                        ends[1][0], ends[1][1], ends[1][2]};
        if (!odd.insert(edge).second) odd.erase(edge);
      }
    }
  }
  return odd;
}

void expect_no_cracks(const Mesh& mesh) {
  ASSERT_TRUE(odd_edges(mesh).empty());
  const RandomFile file = file_in_parts(mesh, small_windows(large(600), 32));
  ASSERT_EQ(file.error, "");
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  ASSERT_GE(open.levels(), 4u);
  Random random(1);
  std::set<uint64_t> sizes;
  for (uint64_t i = 0; i < cases(60); ++i) {
    const Vector3 eye{{4 * random.unit() - 2, 4 * random.unit() - 2, 4 * random.unit() - 2}};
    const View view{eye, std::pow(2.0, 14 * random.unit()), 1};
    Detail detail;
    detail.view = view;
    const Selection selection =
        i % 2 == 0 ? open.select({}, detail).value() : open.select({}, 50 + random.below(9000), view).value();
    sizes.insert(selection.faces);
    EXPECT_TRUE(odd_edges(open.extract(selection).value()).empty()) << i;
  }
  EXPECT_GE(sizes.size(), cases(60) / 6);
}

TEST(RandomSource, HasNoCracksInAnyView) {
  expect_no_cracks(rough_sphere(large(70)));
  expect_no_cracks(unwelded(rough_sphere(large(50))));
}

TEST(RandomSource, HasAFewChartsAtItsRoot) {
  const Mesh mesh = rough_sphere(large(100));
  const RandomFile file = file_in_parts(mesh, small_windows(large(2500), 32));
  ASSERT_EQ(file.error, "");
  const auto info = inspect(*memory_source(Bytes(file.bytes)));
  ASSERT_TRUE(info);
  EXPECT_EQ(info->charts_of_level.back(), 1u);
  // Borders of windows vanish at coarser levels: with groups as small as these, borders are a good part of
  // them.
  for (size_t level = 1; level + 1 < info->faces_of_level.size(); ++level)
    EXPECT_LT(10 * info->faces_of_level[level], 6 * info->faces_of_level[level - 1]) << level;
  for (size_t level = 1; level < info->bound_of_level.size(); ++level) {
    EXPECT_GE(info->bound_of_level[level], info->bound_of_level[level - 1]);
    EXPECT_GE(info->view_error_of_level[level], info->view_error_of_level[level - 1]);
  }
}

TEST(RandomSource, SaysWhatItCannotDo) {
  const Mesh mesh = rough_sphere(20);
  SourceBuilding little = small_windows(100);
  little.space.memory = 1 << 20;
  EXPECT_NE(file_in_parts(mesh, little).error.find("--memory"), std::string::npos);
  // Windows are cut by a sample of points, so this was a crash.
  Mesh pointless = mesh;
  pointless.points.resize(0);
  EXPECT_NE(file_in_parts(pointless, small_windows(100)).error.find("no points"), std::string::npos);
}

TEST(RandomSource, StopsWhenItIsTold) {
  const Mesh mesh = rough_sphere(large(60));
  const auto source_in_memory = mesh_as_source(mesh);
  MeshSource& source = *source_in_memory;
  std::vector<std::byte> bytes;
  for (const int most : {0, 1, 3, 5}) {
    bytes.clear();
    const auto sink = memory_sink(bytes);
    EncodeOptions options;
    options.mode = Mode::random;
    int reports = 0;
    options.progress = [&](const ProgressReport&) { return reports++ < most; };
    const auto report = encode_random(source, *sink, options, small_windows(large(500)));
    ASSERT_FALSE(report) << most;
    EXPECT_EQ(report.error().code, ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace maille::testing
