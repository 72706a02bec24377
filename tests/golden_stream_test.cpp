// Files of mode stream as they are (tests/golden/stream); golden_test.cpp says what to do when this fails.
//
//   UPDATE=1 build/release/tests/test_system --gtest_filter='GoldenStream.*'
#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>
#include <maille/stream.h>

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "support/data.h"
#include "support/files.h"
#include "support/temporary_folder.h"

namespace maille::testing {
namespace {

struct GoldenFile {
  std::string name;
  Mesh mesh;
  EncodeOptions options;
  bool is_lossy = false;
};

// Meshes are made by +, -, *, / only: a sine may be rounded differently elsewhere.

/// n x n x n hexahedra, bent a little.
Mesh bricks(uint32_t n, Scalar type = Scalar::f32) {
  Mesh mesh;
  mesh.points = make_array("position", Domain::point, type, 3);
  const uint32_t m = n + 1;
  mesh.points.resize(uint64_t{m} * m * m);
  for (uint32_t i = 0; i < m * m * m; ++i) {
    const double x = i % m, y = i / m % m, z = i / m / m;
    const double place[] = {x + y * z / 16, y * y / 8, z - x * y / 32};
    for (uint32_t k = 0; k < 3; ++k) {
      if (type == Scalar::f32)
        mesh.points.values<float>()[3 * i + k] = static_cast<float>(place[k]);
      else
        mesh.points.values<double>()[3 * i + k] = place[k] / 3;
    }
  }
  CellBlock& block = mesh.blocks.emplace_back();
  block.name = "bricks";
  block.type = CellType::hexahedron;
  for (uint32_t i = 0; i < n * n * n; ++i) {
    const uint32_t p = i % n + i / n % n * m + i / n / n * m * m;
    for (const uint32_t q : {p, p + m * m})
      block.connectivity.insert(block.connectivity.end(), {q, q + 1, q + 1 + m, q + m});
  }
  return mesh;
}

/// Each brick is cut into something else; sides of polygons; cells without a shape.
Mesh mixed_cells() {
  Mesh mesh = bricks(3);
  const Buffer<uint32_t> all = mesh.blocks[0].connectivity;
  CellBlock block;
  block.name = "mixed";
  block.type = CellType::mixed;
  block.offsets = {0};
  const auto add = [&](CellType type, const std::vector<uint32_t>& points) {
    block.types.push_back(static_cast<uint8_t>(type));
    block.connectivity.insert(block.connectivity.end(), points.begin(), points.end());
    block.offsets.push_back(block.connectivity.size());
  };
  for (size_t i = 0; i < all.size(); i += 8) {
    const uint32_t* p = all.data() + i;
    if (i / 8 % 4 == 0) add(CellType::hexahedron, {p, p + 8});
    if (i / 8 % 4 == 1) {
      add(CellType::wedge, {p[0], p[1], p[2], p[4], p[5], p[6]});
      add(CellType::wedge, {p[0], p[2], p[3], p[4], p[6], p[7]});
    }
    if (i / 8 % 4 == 2) {
      add(CellType::pyramid, {p[0], p[1], p[2], p[3], p[6]});
      add(CellType::tetrahedron, {p[0], p[1], p[5], p[6]});
      add(CellType::voxel, {p[0], p[1], p[3], p[2], p[4], p[5], p[7], p[6]});
    }
    if (i / 8 % 4 == 3) {
      add(CellType::quad, {p[0], p[1], p[2], p[3]});
      add(CellType::triangle, {p[4], p[5], p[6]});
      add(CellType::line, {p[0], p[7]});
      add(CellType::vertex, {p[6]});
      add(CellType::polygon, {p[0], p[1], p[5], p[6], p[7]});
      add(CellType::poly_line, {p[0], p[2], p[5]});
    }
  }
  add(CellType::quadratic_tetrahedron, {0, 1, 4, 16, 40, 41, 42, 43, 44, 45});
  add(CellType::hexahedron, {1, 1, 2, 2, 3, 3, 2, 1});
  mesh.blocks[0] = block;
  return mesh;
}

/// Bricks on a floor of quads, in no order: such cells come at gates.
Mesh scattered_bricks() {
  Mesh mesh = bricks(6);
  CellBlock& block = mesh.blocks[0];
  const Buffer<uint32_t> all = block.connectivity;
  const auto points = static_cast<uint32_t>(mesh.point_count()),
             cells = static_cast<uint32_t>(all.size() / 8);
  for (uint32_t i = 0; i < all.size(); ++i)
    block.connectivity[i] = all[i / 8 * 101 % cells * 8 + i % 8] * 173 % points;
  CellBlock floor;
  floor.name = "floor";
  floor.type = CellType::quad;
  for (uint32_t i = 0; i < 36; ++i) {
    const uint32_t* p = all.data() + size_t{i} * 29 % 36 * 8;
    for (const uint32_t point : {p[0], p[1], p[2], p[3]}) floor.connectivity.push_back(point * 173 % points);
  }
  mesh.blocks.push_back(floor);
  return mesh;
}

/// Bricks given by their faces, with a floor of polygons.
Mesh polyhedra() {
  Mesh mesh = bricks(4);
  const Buffer<uint32_t> all = mesh.blocks[0].connectivity;
  CellBlock block, floor;
  block.type = CellType::polyhedron;
  block.offsets = block.cell_faces = {0};
  floor.name = "floor";
  floor.type = CellType::polygon;
  floor.offsets = {0};
  for (size_t i = 0; i < all.size(); i += 8) {
    const uint32_t* p = all.data() + i;
    for (const auto& face :
         {std::array{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}}) {
      for (const int corner : face) block.connectivity.push_back(p[corner]);
      block.face_sizes.push_back(4);
    }
    block.offsets.push_back(block.connectivity.size());
    block.cell_faces.push_back(block.face_sizes.size());
    if (i >= 16 * 8) continue;
    floor.connectivity.insert(floor.connectivity.end(), {p[1], p[2], p[3], p[0]});
    floor.offsets.push_back(floor.connectivity.size());
  }
  floor.connectivity.insert(floor.connectivity.end(), {0, 1, 7, 30, 22});
  floor.offsets.push_back(floor.connectivity.size());
  mesh.blocks = {block, floor};
  return mesh;
}

Mesh with_fields() {
  Mesh mesh = bricks(4, Scalar::f64);
  Array pressure = make_array("pressure", Domain::point, Scalar::f32, 1);
  pressure.resize(mesh.point_count());
  for (size_t i = 0; i < mesh.point_count(); ++i)
    pressure.values<float>()[i] = static_cast<float>(i % 5) / 3 + static_cast<float>(i / 25);
  const uint32_t nan = 0x7fc12345;
  std::memcpy(pressure.bytes.data() + 40, &nan, 4);
  Array flow = make_array("flow", Domain::cell, Scalar::f64, 3);
  flow.resize(mesh.cell_count());
  for (size_t i = 0; i < 3 * mesh.cell_count(); ++i)
    flow.values<double>()[i] = static_cast<double>(i % 7) / 9;
  Array group = make_array("group", Domain::cell, Scalar::u16, 1, Role::label);
  group.resize(mesh.cell_count());
  group.values<uint16_t>()[3] = 2;
  group.labels = {"a", "b", "c"};
  Array time = make_array("time", Domain::mesh, Scalar::f64, 1);
  time.resize(1);
  mesh.arrays = {pressure, flow, group, time};
  mesh.metadata = {{"case", "golden"}};
  return mesh;
}

/// Positions that hold floats, and numbers of cells that come again in no order: floats times a factor of 1,
/// and a table.
Mesh with_doubles() {
  Mesh mesh = bricks(6, Scalar::f64);
  for (double& x : mesh.points.values<double>()) x = static_cast<float>(x);
  Array& density = mesh.arrays.emplace_back(make_array("density", Domain::cell, Scalar::f64, 1));
  density.resize(mesh.cell_count());
  for (uint32_t i = 0; i < density.count(); ++i) density.values<double>()[i] = 1 / (3.0 + i * i * 7919 % 13);
  return mesh;
}

std::vector<GoldenFile> goldens() {
  std::vector<GoldenFile> all;
  const auto add = [&](const char* name, Mesh mesh) -> GoldenFile& {
    EncodeOptions options;
    options.mode = Mode::stream;
    options.order = Order::keep;
    return all.emplace_back(GoldenFile{name, std::move(mesh), options});
  };
  add("empty", {});
  add("bricks", bricks(6));
  add("fast", mixed_cells()).options.effort = 1;
  add("mixed_cells", mixed_cells());
  add("gates", scattered_bricks()).options.effort = 1;
  GoldenFile& mixed = add("mixed_gates", scattered_bricks());
  mixed.is_lossy = true;  // in another order
  mixed.options.order = Order::canonical;
  add("polyhedra", polyhedra());
  add("fields", with_fields());
  add("doubles", with_doubles());
  GoldenFile& lossy = add("lossy_fields", with_fields());
  lossy.is_lossy = true;
  lossy.options.positions = {Tolerance::Kind::bits, 12};
  lossy.options.arrays = {{"pressure", {Tolerance::Kind::absolute, 0.01}},
                          {"flow", {Tolerance::Kind::relative, 0.001}}};
  GoldenFile& any = add("any_order", mixed_cells());
  any.is_lossy = true;  // in another order
  any.options.order = Order::canonical;
  add("pieces", with_fields()).options.most_cells_per_part = 20;
  GoldenFile& pieces = add("any_order_pieces", scattered_bricks());
  pieces.is_lossy = true;  // in another order
  pieces.options.order = Order::canonical;
  pieces.options.most_cells_per_part = 80;
  return all;
}

const std::filesystem::path folder = tests_folder() + "/golden/stream";

std::vector<std::byte> encoded(const GoldenFile& golden) {
  std::vector<std::byte> bytes;
  const auto report = encode(golden.mesh, *memory_sink(bytes), golden.options);
  EXPECT_TRUE(report) << golden.name << ": " << report.error().message;
  return bytes;
}

/// The fields with a second step.
Mesh second_step() {
  Mesh mesh = with_fields();
  for (float& value : mesh.arrays[0].values<float>()) value += 0.25f;
  mesh.arrays.erase(mesh.arrays.begin() + 1);
  return mesh;
}

std::vector<std::byte> with_step(const std::vector<std::byte>& file) {
  const testing::TemporaryFolder temporary;
  const std::string path = temporary.path("step.maille");
  write_bytes(path, file);
  const auto report = append_step(path, 0.5, second_step());
  EXPECT_TRUE(report) << report.error().message;
  return read_bytes(path);
}

class GoldenStream : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const char* update = std::getenv("UPDATE");
    if (update == nullptr || std::string(update) != "1") return;
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    for (const GoldenFile& golden : goldens()) {
      const std::vector<std::byte> bytes = encoded(golden);
      write_bytes(folder / (golden.name + ".maille"), bytes);
      if (golden.name == "fields") write_bytes(folder / "steps.maille", with_step(bytes));
    }
  }
};

CompareOptions strict() {
  CompareOptions options;
  options.same_order = true;
  return options;
}

TEST_F(GoldenStream, FilesAreDecoded) {
  for (const GoldenFile& golden : goldens()) {
    const auto mesh = decode(*memory_source(Bytes(read_bytes(folder / (golden.name + ".maille")))));
    ASSERT_TRUE(mesh) << golden.name << ": " << mesh.error().message;
    EXPECT_EQ(mesh->cell_count(), golden.mesh.cell_count());
    EXPECT_TRUE(golden.is_lossy || compare(golden.mesh, *mesh, strict()).equal) << golden.name;
  }
}

TEST_F(GoldenStream, FilesAreWrittenByteForByte) {
  for (const GoldenFile& golden : goldens())
    EXPECT_TRUE(encoded(golden) == read_bytes(folder / (golden.name + ".maille"))) << golden.name;
}

TEST_F(GoldenStream, StepsAreReadAndAppendedByteForByte) {
  const std::vector<std::byte> file = read_bytes(folder / "steps.maille");
  EXPECT_TRUE(with_step(read_bytes(folder / "fields.maille")) == file);
  DecodeOptions options;
  options.step = 1;
  const auto mesh = decode(*memory_source(Bytes(file)), options);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_TRUE(compare(second_step(), *mesh, strict()).equal);
  EXPECT_EQ(inspect(*memory_source(Bytes(file)))->steps.at(0).time, 0.5);
}

}  // namespace
}  // namespace maille::testing
