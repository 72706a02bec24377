// Charts whose adaptive models begin with what a sample taught.
#include <gtest/gtest.h>
#include <maille/random_access.h>

#include <cmath>

#include "base/bytes.h"
#include "container/file_reader.h"
#include "mesh/mesh_as_source.h"
#include "numbers/number_maps.h"
#include "random/random_file.h"
#include "random/random_layout.h"
#include "support/codec.h"
#include "support/random.h"
#include "support/random_file.h"
#include "support/shapes.h"
#include "surface/fans/adaptive_start.h"

namespace maille::testing {
namespace {

Mesh rough_sphere() {
  Mesh mesh = to_mesh(triangulated(shapes::sphere(110, 110)));
  Random random(1);
  for (float& x : mesh.points.values<float>()) x *= static_cast<float>(1 + 0.001 * random.unit());
  return mesh;
}

EncodeOptions adaptive(int effort) {
  EncodeOptions options;
  options.mode = Mode::random;
  options.effort = effort;
  options.positions = {Tolerance::Kind::bits, 10};
  return options;
}

std::vector<std::byte> start_of(const std::vector<std::byte>& file) {
  const auto source = memory_source(Bytes(file));
  const FileReader reader = FileReader::open(*source).value();
  return reader.has_stream(tables_key(0)) ? reader.read_stream(tables_key(0)).value()
                                          : std::vector<std::byte>();
}

TEST(ChartStart, GivesTheSameMeshWithAndWithoutIt) {
  const Mesh mesh = rough_sphere();
  for (const int effort : {4, 5, 6, 7, 9}) {
    const RandomFile small_charts = random_file(mesh, adaptive(effort), 256);
    ASSERT_EQ(small_charts.error, "");
    EXPECT_FALSE(start_of(small_charts.bytes).empty());
    const RandomFile large_charts = random_file(mesh, adaptive(effort), 4096);
    ASSERT_EQ(large_charts.error, "");
    EXPECT_TRUE(start_of(large_charts.bytes).empty());
    EXPECT_EQ(differences_between(decode_bytes(large_charts.bytes).value(),
                                  decode_bytes(small_charts.bytes).value()),
              "");
  }
}

TEST(ChartStart, IsThereForMeshesInWindows) {
  Mesh mesh = rough_sphere();
  mesh.blocks[0].type = CellType::triangle;
  mesh.blocks[0].offsets.clear();
  SourceBuilding building;
  building.sizes.chart_faces = 200;
  building.window_faces = 6000;
  building.space.memory = uint64_t{1} << 30;
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  const auto source = mesh_as_source(mesh);
  const auto report = encode_random(*source, *sink, adaptive(5), building);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_FALSE(start_of(bytes).empty());
  const RandomFile whole = random_file(mesh, adaptive(5), 4096);
  EXPECT_EQ(differences_between(decode_bytes(whole.bytes).value(), decode_bytes(bytes).value()), "");
}

/// Points of a voxel lattice's edges: two coordinates are levels, the third is one of a few hundred numbers.
Mesh voxel_sphere() {
  Mesh mesh = rough_sphere();
  const auto numbers = mesh.points.values<float>();
  for (size_t i = 0; i < numbers.size(); ++i) {
    const bool level = i % 3 != (i / 3) % 3;
    const float step = level ? 0.05f : 0.05f / 9;
    numbers[i] = std::round(numbers[i] / step) * step;
  }
  return mesh;
}

TEST(ChartStart, KnowsTheNumbersOfTheWholeMeshWhereTheyComeAgain) {
  const Mesh mesh = voxel_sphere();
  EncodeOptions lossless;
  lossless.mode = Mode::random;
  lossless.effort = 5;
  const RandomFile file = random_file(mesh, lossless, 256);
  ASSERT_EQ(file.error, "");
  const std::vector<std::byte> start = start_of(file.bytes);
  ASSERT_FALSE(start.empty());
  ByteReader in(start);
  in.get<uint8_t>();
  const auto map = read_map(in, Scalar::f32);
  ASSERT_TRUE(map);
  EXPECT_FALSE(map->table.empty());
  EXPECT_EQ(differences_between(mesh, decode_bytes(file.bytes).value()), "");
}

TEST(ChartStart, HoldsChartsOfEdgesWithThreeFaces) {
  Mesh mesh = rough_sphere();
  std::vector<uint32_t>& corners = mesh.blocks[0].connectivity;
  const auto points = static_cast<uint32_t>(mesh.point_count());
  // Fins on a few faces, far fewer than charts.
  for (uint32_t fin = 0; fin < 20; ++fin) {
    const std::vector<uint32_t> edge(corners.begin() + 3000 * fin, corners.begin() + 3000 * fin + 2);
    corners.insert(corners.end(), {edge[0], edge[1], points + fin});
    if (!mesh.blocks[0].offsets.empty()) mesh.blocks[0].offsets.push_back(corners.size());
    for (const float x : {2.0f, static_cast<float>(fin), 0.0f}) {
      const auto* bytes = reinterpret_cast<const std::byte*>(&x);
      mesh.points.bytes.insert(mesh.points.bytes.end(), bytes, bytes + sizeof x);
    }
  }
  EncodeOptions lossless = adaptive(5);
  lossless.positions = {};
  const RandomFile file = random_file(mesh, lossless, 256);
  ASSERT_EQ(file.error, "");
  EXPECT_FALSE(start_of(file.bytes).empty());
  EXPECT_EQ(differences_between(mesh, decode_bytes(file.bytes).value()), "");
}

TEST(ChartStart, IsRefusedWhereItIsDamaged) {
  const std::vector<std::byte> start = start_of(random_file(rough_sphere(), adaptive(5), 256).bytes);
  ASSERT_FALSE(start.empty());
  ASSERT_TRUE(read_start(start, Scalar::f32));
  for (size_t size = 0; size < start.size() / 2; size += 3) {
    const auto read = read_start(Bytes(start).first(size), Scalar::f32);
    ASSERT_FALSE(read) << size;
    EXPECT_EQ(read.error().code, ErrorCode::corrupt);
  }
  Random random(2);
  for (int i = 0; i < 300; ++i) {
    std::vector<std::byte> damaged = start;
    damaged[random.below(damaged.size())] ^= static_cast<std::byte>(1 + random.below(255));
    const auto read = read_start(damaged, Scalar::f32);  // or another start, which is as good
    if (!read) {
      EXPECT_EQ(read.error().code, ErrorCode::corrupt);
    }
  }
}

}  // namespace
}  // namespace maille::testing
