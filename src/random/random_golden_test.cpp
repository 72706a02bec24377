// Files of mode `random` as they are: tests/golden/random. Written anew by
//   UPDATE=1 build/release/tests/test_hierarchy --gtest_filter='RandomGolden.*'
// See tests/golden_test.cpp for when. And the examples of docs/format.md, 17.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <maille/random_access.h>

#include <cstdlib>
#include <filesystem>

#include "random/random_layout.h"
#include "support/codec.h"
#include "support/data.h"
#include "support/files.h"
#include "support/format_document.h"
#include "support/random_file.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

struct GoldenFile {
  std::string name;
  Mesh mesh;
  EncodeOptions options;
};

/// Made by +, -, *, / only: a sine may be rounded differently elsewhere.
Mesh saddle(uint32_t n, bool triangles, Scalar type) {
  Surface surface;
  for (uint32_t j = 0; j <= n; ++j) {
    for (uint32_t i = 0; i <= n; ++i) {
      const double x = i - n / 2.0, y = j - n / 2.0;
      surface.points.push_back({x, y, (x * x - y * y) / 8 + (i * 7 + j * 5) % 3 / 4.0});
    }
  }
  for (uint32_t j = 0; j < n; ++j) {
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = j * (n + 1) + i;
      surface.faces.push_back({a, a + 1, a + n + 2, a + n + 1});
    }
  }
  return to_mesh(triangles ? triangulated(surface) : surface, type);
}

Mesh with_arrays(Mesh mesh) {
  const auto add = [&](const char* name, Domain domain, uint64_t tuples) {
    Array array = make_array(name, domain, Scalar::u8, 2);
    array.resize(tuples);
    for (uint64_t i = 0; i < 2 * tuples; ++i) array.bytes[i] = static_cast<std::byte>(i * i % 13);
    mesh.arrays.push_back(std::move(array));
  };
  add("colour", Domain::point, mesh.point_count());
  add("material", Domain::cell, mesh.cell_count());
  add("uv", Domain::corner, mesh.corner_count());
  add("unit", Domain::mesh, 2);
  return mesh;
}

std::vector<GoldenFile> goldens() {
  std::vector<GoldenFile> all;
  all.push_back({"empty", {}, {}});
  all.push_back({"triangles", saddle(16, true, Scalar::f32), {}});
  all.push_back({"arrays", with_arrays(saddle(8, false, Scalar::f64)), {}});
  all.push_back({"keep_order", saddle(8, true, Scalar::i32), {}});
  all.back().options.order = Order::keep;
  return all;
}

std::string path_of(const std::string& name) {
  return tests_folder() + "/golden/random/" + name + ".maille";
}

bool is_update() {
  const char* update = std::getenv("UPDATE");
  return update != nullptr && std::string(update) == "1";
}

TEST(RandomGolden, FilesAreReadAndWritten) {
  for (const GoldenFile& golden : goldens()) {
    const RandomFile written = random_file(golden.mesh, golden.options, 48);
    ASSERT_EQ(written.error, "") << golden.name;
    if (is_update()) {
      std::filesystem::create_directories(tests_folder() + "/golden/random");
      write_bytes(path_of(golden.name), written.bytes);
    }
    const std::vector<std::byte> recorded = read_bytes(path_of(golden.name));
    EXPECT_TRUE(recorded == written.bytes) << golden.name << ": the encoder writes other bytes";
    const auto decoded = decode(*memory_source(recorded));
    ASSERT_TRUE(decoded) << golden.name << ": " << decoded.error().message;
    EXPECT_EQ(differences_between(golden.mesh, *decoded, golden.options.order == Order::keep), "")
        << golden.name;
  }
}

std::string hex(Bytes bytes) {
  static constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (const std::byte byte : bytes) {
    if (!text.empty()) text += ' ';
    text += digits[std::to_integer<unsigned>(byte) >> 4];
    text += digits[std::to_integer<unsigned>(byte) & 15];
  }
  return text;
}

constexpr IndexFrame frame = {{{-1, 0, 2}}, 65535.0 / 8192};

TEST(RandomDocument, HasTheDirectoryOfItsExample) {
  ChartDirectory directory;
  directory.groups = 2;
  directory.levels = 2;
  directory.faces = {300, 75};
  directory.charts = {2, 1};
  directory.frame = frame;
  directory.finest = {200, {1000}, 20};
  directory.coarser = {60, {240}, 5};
  directory.index_pages = {{300, 145}};
  EXPECT_EQ(hex(encode_directory(directory)), hex(example_of_document("directory")));
}

TEST(RandomDocument, HasTheIndexOfItsExample) {
  constexpr double step = 1.0 / 8192;
  IndexedGroup root{1, HUGE_VAL, HUGE_VAL, {{{0, 1, 3}}, 1}, 0, 500, {}};
  root.charts.push_back({{{{0, 1, 3}}, 1 - 3 * step}, {{{-1, 0, 2}}, {{1, 2, 4}}}, 1, 75, 305, 0x12345678});
  IndexedGroup finest{0, 0.25, 0.5, {{{0, 1, 3}}, 1}, 1, 900, {}};
  finest.charts.push_back({{{{0.5, 1, 3}}, 0.5}, {{{0, 0.5, 2.5}}, {{1, 1.5, 3.5}}}, no_group, 160, 650, 1});
  finest.charts.push_back(
      {{{{-0.5, 1, 3}}, 0.5}, {{{-1, 0.5, 2.5}}, {{0, 1.5, 3.5}}}, no_group, 140, 570, 2});
  const IndexedGroup groups[] = {root, finest};
  EXPECT_EQ(hex(encode_index_page(frame, groups, 0)), hex(example_of_document("index")));
}

TEST(RandomDocument, HasTheHeadOfItsExample) {
  const PageHead head{0, 1, 0.25, 0.5, {{no_group, 160, 650}, {no_group, 140, 570}}};
  EXPECT_EQ(hex(encode_page_head(head)), hex(example_of_document("head")));
}

TEST(RandomDocument, StatesTheSizeOfPages) {
  EXPECT_EQ(groups_per_index_page, 256u);
}

}  // namespace
}  // namespace maille::testing
