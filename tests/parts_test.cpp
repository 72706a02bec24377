// Meshes of several parts: cut, coded at once, joined again.
#include "support/codec.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <maille/executor.h>
#include <maille/file.h>

#include <atomic>
#include <random>
#include <thread>

namespace maille::testing {
namespace {

EncodeOptions in_parts(uint64_t most_cells, Order order = Order::canonical, int effort = 5) {
  EncodeOptions options;
  options.mode = Mode::single;
  options.most_cells_per_part = most_cells;
  options.order = order;
  options.effort = effort;
  return options;
}

std::string round_trip(const Mesh& mesh, const EncodeOptions& options) {
  const auto encoded = encode_bytes(mesh, options);
  if (!encoded) return "encode: " + encoded.error().message;
  const auto decoded = decode_bytes(encoded->bytes);
  if (!decoded) return "decode: " + decoded.error().message;
  return differences_between(mesh, *decoded, options.order == Order::keep);
}

TEST(Parts, AnyMeshComesBack) {
  RandomMeshOptions meshes;
  meshes.other_cells = true;
  for (const int effort : {2, 5, 8}) {
    for (const uint64_t most_cells : {1u, 7u, 30u}) {
      const auto property = [&](const Mesh& mesh) {
        return round_trip(mesh, in_parts(most_cells, Order::canonical, effort));
      };
      EXPECT_EQ(check_random_surfaces(70000, 20, meshes, property), "")
          << "effort " << effort << ", " << most_cells;
    }
  }
}

TEST(Parts, AnyMeshComesBackInItsOrder) {
  RandomMeshOptions meshes;
  meshes.other_cells = true;
  const auto property = [&](const Mesh& mesh) { return round_trip(mesh, in_parts(9, Order::keep)); };
  EXPECT_EQ(check_random_surfaces(71000, 150, meshes, property), "");
}

TEST(Parts, DecodedMeshesGiveTheSameFileAgain) {
  const auto property = [&](const Mesh& mesh) -> std::string {
    const auto once = encode_bytes(mesh, in_parts(20));
    if (!once) return once.error().message;
    const auto decoded = decode_bytes(once->bytes);
    if (!decoded) return decoded.error().message;
    const auto twice = encode_bytes(*decoded, in_parts(20));
    if (!twice) return twice.error().message;
    return once->bytes == twice->bytes ? "" : "the second file differs";
  };
  EXPECT_EQ(check_random_surfaces(72000, 100, {}, property), "");
}

TEST(Parts, LossyMeshesAreCutAlongDecodedPositions) {
  Mesh mesh = torus(60, 40);
  EncodeOptions options = in_parts(300);
  options.positions = {Tolerance::Kind::absolute, 0.05};
  const auto once = encode_bytes(mesh, options);
  ASSERT_TRUE(once);
  EXPECT_LE(once->report.positions.maximum_error, 0.05);
  const auto decoded = decode_bytes(once->bytes);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->point_count(), mesh.point_count());
  const auto twice = encode_bytes(*decoded, options);
  ASSERT_TRUE(twice);
  EXPECT_EQ(once->bytes, twice->bytes);
}

TEST(Parts, ThreadsDoNotChangeAFile) {
  const Mesh mesh = torus(100, 60);
  EncodeOptions options = in_parts(500);
  const auto serial = encode_bytes(mesh, options);
  const auto threads = thread_executor(4);
  options.executor = threads.get();
  const auto parallel = encode_bytes(mesh, options);
  ASSERT_TRUE(serial);
  ASSERT_TRUE(parallel);
  EXPECT_EQ(serial->bytes, parallel->bytes);
  DecodeOptions decoding;
  decoding.executor = threads.get();
  const auto decoded = decode(*memory_source(parallel->bytes), decoding);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(differences_between(mesh, *decoded, false), "");
}

TEST(Parts, CanBeCancelled) {
  const Mesh mesh = torus(100, 60);
  EncodeOptions options = in_parts(500);
  options.progress = [](const ProgressReport&) { return false; };
  const auto encoded = encode_bytes(mesh, options);
  ASSERT_FALSE(encoded);
  EXPECT_EQ(encoded.error().code, ErrorCode::cancelled);
}

TEST(Parts, ProgressIsToldOnTheCallingThread) {
  const Mesh mesh = torus(100, 60);
  const auto threads = thread_executor(4);
  const auto caller = std::this_thread::get_id();
  std::atomic<int> reports = 0, elsewhere = 0;
  const Progress watch = [&](const ProgressReport&) {
    ++reports;
    if (std::this_thread::get_id() != caller) ++elsewhere;
    return true;
  };
  EncodeOptions options = in_parts(100);
  options.executor = threads.get();
  options.progress = watch;
  const auto encoded = encode_bytes(mesh, options);
  ASSERT_TRUE(encoded);
  DecodeOptions decoding;
  decoding.executor = threads.get();
  decoding.progress = watch;
  ASSERT_TRUE(decode(*memory_source(encoded->bytes), decoding));
  EXPECT_GT(reports, 0);
  EXPECT_EQ(elsewhere, 0);
}

TEST(Parts, InspectTellsTypesOfMixedBlocks) {
  Mesh mesh = torus(6, 4);
  CellBlock lines;
  lines.type = CellType::mixed;
  lines.types = {3, 3, 1};
  lines.offsets = {0, 2, 4, 5};
  lines.connectivity = {0, 1, 1, 2, 3};
  const CellType faces = mesh.blocks[0].type;
  const uint64_t face_count = mesh.cell_count();
  mesh.blocks.push_back(lines);
  const auto encoded = encode_bytes(mesh, in_parts(1000));
  ASSERT_TRUE(encoded);
  const auto info = inspect(*memory_source(encoded->bytes));
  ASSERT_TRUE(info);
  const std::vector<std::pair<CellType, uint64_t>> types = {
      {CellType::vertex, 1}, {CellType::line, 2}, {faces, face_count}};
  EXPECT_EQ(info->types, types);
}

TEST(Parts, InspectAddsThemUp) {
  const Mesh mesh = torus(60, 40);
  const auto encoded = encode_bytes(mesh, in_parts(400));
  ASSERT_TRUE(encoded);
  const auto info = inspect(*memory_source(encoded->bytes));
  ASSERT_TRUE(info);
  EXPECT_EQ(info->parts, 8u);
  EXPECT_EQ(info->points, mesh.point_count());
  EXPECT_EQ(info->connectivity.coded_bytes, encoded->report.connectivity.coded_bytes);
  EXPECT_EQ(info->positions.coded_bytes, encoded->report.positions.coded_bytes);
}

TEST(Parts, DamageIsFound) {
  const Mesh mesh = random_surface(5);
  const auto encoded = encode_bytes(mesh, in_parts(10));
  ASSERT_TRUE(encoded);
  std::mt19937 random(1);
  for (int i = 0; i < 300; ++i) {
    std::vector<std::byte> bytes = encoded->bytes;
    bytes[random() % bytes.size()] ^= static_cast<std::byte>(1u << random() % 8);
    const auto decoded = decode_bytes(bytes);
    if (!decoded) continue;
    EXPECT_EQ(differences_between(mesh, *decoded, false), "") << i;
  }
}

}  // namespace
}  // namespace maille::testing
