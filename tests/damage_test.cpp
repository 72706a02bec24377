#include "support/cases.h"
#include "support/codec.h"
#include "support/data.h"
#include "support/files.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <numeric>
#include <set>

namespace maille::testing {
namespace {

struct File {
  std::string name;
  Mesh decoded;
  std::vector<std::byte> bytes;
};

File file_of(const std::string& name, const Mesh& mesh, const EncodeOptions& options = {}) {
  const auto encoded = encode_bytes(mesh, options);
  EXPECT_TRUE(encoded) << name << ": " << encoded.error().message;
  if (!encoded) return {name, {}, {}};
  auto decoded = decode_bytes(encoded->bytes);
  EXPECT_TRUE(decoded) << name << ": " << decoded.error().message;
  return {name, decoded ? std::move(*decoded) : Mesh{}, encoded->bytes};
}

Mesh triangle_sphere(uint32_t around, uint32_t up) {
  return to_mesh(triangulated(shapes::sphere(around, up)));
}

/// Small files of all kinds: nothing, faces only, all arrays, order kept, lossy.
std::vector<File> small_files() {
  std::vector<File> files;
  files.push_back(file_of("empty", Mesh{}));
  files.push_back(file_of("cube", cube()));
  EncodeOptions options;
  options.positions = {Tolerance::Kind::bits, 10};
  files.push_back(file_of("torus at 10 bits", torus(9, 6), options));
  options.effort = 9;
  files.push_back(file_of("torus, mixed", torus(9, 6), options));
  options.effort = 5;
  options.order = Order::keep;
  files.push_back(file_of("sphere in order", shuffled(sphere(9, 6), 1), options));
  EncodeOptions fast;
  fast.effort = 2;
  files.push_back(file_of("fast", triangle_sphere(9, 6), fast));
  fast.positions = {Tolerance::Kind::bits, 10};
  fast.order = Order::keep;
  files.push_back(file_of("fast, at 10 bits, in order", shuffled(triangle_sphere(9, 7), 2), fast));
  for (uint64_t seed = 0; seed < 200 && files.size() < 13; ++seed) {
    const Mesh mesh = random_surface(seed, {.faces = 30});
    if (mesh.arrays.size() < 3 || mesh.cell_count() < 5) continue;
    options.positions = {};
    options.order = seed % 2 == 0 ? Order::keep : Order::canonical;
    files.push_back(file_of("seed " + std::to_string(seed), mesh, options));
  }
  return files;
}

/// Empty when a damaged file gives an error of a fitting kind, or still the very mesh.
std::string reaction(const File& file, const std::vector<std::byte>& damaged) {
  DecodeOptions options;
  options.limits.mesh_bytes = 64 << 20;
  const auto decoded = decode_bytes(damaged, options);
  if (decoded) {
    const std::string differences = differences_between(file.decoded, *decoded, true);
    return differences.empty() ? "" : "decodes to another mesh: " + differences;
  }
  static const std::set<ErrorCode> fitting = {ErrorCode::corrupt, ErrorCode::unsupported,
                                              ErrorCode::memory_bound};
  if (fitting.count(decoded.error().code) == 0) return "odd error code: " + decoded.error().message;
  return decoded.error().message.empty() ? "error without a message" : "";
}

TEST(Damage, EveryTruncationIsNoticed) {
  for (const File& file : small_files()) {
    for (size_t size = 0; size < file.bytes.size(); ++size) {
      const std::vector<std::byte> part(file.bytes.begin(),
                                        file.bytes.begin() + static_cast<std::ptrdiff_t>(size));
      ASSERT_EQ(reaction(file, part), "")
          << file.name << ", first " << size << " of " << file.bytes.size() << " bytes";
    }
  }
}

TEST(Damage, EveryFlippedBitIsNoticedOrHarmless) {
  for (const File& file : small_files()) {
    Random random(file.bytes.size());
    for (uint64_t i = 0; i < cases(1000); ++i) {
      std::vector<std::byte> damaged = file.bytes;
      const size_t at = random.below(damaged.size());
      const uint32_t bit = random.below(8);
      damaged[at] ^= static_cast<std::byte>(1u << bit);
      ASSERT_EQ(reaction(file, damaged), "")
          << file.name << ", bit " << bit << " of byte " << at << " of " << damaged.size();
    }
  }
}

TEST(Damage, OverwrittenRangesAreNoticed) {
  for (const File& file : small_files()) {
    Random random(file.bytes.size() + 1);
    for (uint64_t i = 0; i < cases(300); ++i) {
      std::vector<std::byte> damaged = file.bytes;
      const size_t at = random.below(damaged.size());
      const size_t end = std::min(damaged.size(), at + random.between(1, 64));
      const bool zeros = random.chance(50);
      for (size_t k = at; k < end; ++k) damaged[k] = static_cast<std::byte>(zeros ? 0 : random.below(256));
      ASSERT_EQ(reaction(file, damaged), "") << file.name << ", bytes " << at << " to " << end;
    }
  }
}

TEST(Damage, LostAndDoubledBytesAreNoticed) {
  for (const File& file : small_files()) {
    Random random(file.bytes.size() + 2);
    for (uint64_t i = 0; i < cases(200); ++i) {
      std::vector<std::byte> damaged = file.bytes;
      const auto at = damaged.begin() + random.below(damaged.size());
      if (random.chance(50)) {
        damaged.erase(at);
      } else {
        damaged.insert(at, *at);
      }
      ASSERT_EQ(reaction(file, damaged), "") << file.name << ", change " << i;
    }
  }
}

TEST(Damage, PartsOfTwoFilesMakeNoThird) {
  const std::vector<File> files = small_files();
  Random random(1);
  for (uint64_t i = 0; i < cases(500); ++i) {
    const File& front = files[random.below(files.size())];
    const File& back = files[random.below(files.size())];
    if (&front == &back) continue;
    std::vector<std::byte> joined = front.bytes;
    joined.resize(random.below(joined.size()));
    joined.insert(joined.end(), back.bytes.begin() + random.below(back.bytes.size()), back.bytes.end());
    const std::string as_front = reaction(front, joined), as_back = reaction(back, joined);
    ASSERT_TRUE(as_front.empty() || as_back.empty())
        << front.name << " and " << back.name << ": " << as_front;
  }
}

TEST(Damage, OtherFilesAreRefused) {
  Random random(2);
  for (const size_t size : {0u, 1u, 7u, 8u, 64u, 1000u, 100000u}) {
    std::vector<std::byte> noise(size);
    for (std::byte& byte : noise) byte = static_cast<std::byte>(random.below(256));
    const auto decoded = decode_bytes(noise);
    ASSERT_FALSE(decoded);
    EXPECT_FALSE(decoded.error().message.empty());
  }
}

/// Files with good checksums and bad intentions, each beside its exit code and sentence: x.maille,
/// x.maille.error.
TEST(Damage, HostileFilesAreNamedInOneSentence) {
  unsigned files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(tests_folder() + "/corrupt/maille")) {
    const std::string path = entry.path().string();
    if (!std::filesystem::exists(path + ".error")) continue;
    const std::string bytes = read_text(path);
    const auto source = memory_source(std::as_bytes(std::span(bytes)), entry.path().filename().string());
    DecodeOptions options;
    options.limits.mesh_bytes = 64 << 20;
    const auto decoded = decode(*source, options);
    ASSERT_FALSE(decoded) << path;
    std::string expected = read_text(path + ".error");
    expected.pop_back();
    EXPECT_EQ(std::to_string(static_cast<int>(decoded.error().code)) + " " + decoded.error().message,
              expected);
    ++files;
  }
  EXPECT_GE(files, 1u);
}

/// Meshes that took minutes, hours or days while some step looked at all elements for each of them.
class HostileMesh : public ::testing::Test {
 protected:
  Mesh mesh;

  void points(uint64_t count) { mesh.points.resize(count); }
  void block(CellType type) {
    mesh.blocks.emplace_back().type = type;
    if (nodes_of(type) == 0) mesh.blocks.back().offsets.push_back(0);
  }
  void cell(std::initializer_list<uint32_t> nodes) {
    CellBlock& last = mesh.blocks.back();
    last.connectivity.insert(last.connectivity.end(), nodes);
    if (!last.offsets.empty()) last.offsets.push_back(last.connectivity.size());
  }
  /// A cell of the points first ... first + count - 1.
  void cell_of_run(uint32_t first, uint32_t count) {
    CellBlock& last = mesh.blocks.back();
    last.connectivity.resize(last.connectivity.size() + count);
    std::iota(last.connectivity.end() - count, last.connectivity.end(), first);
    last.offsets.push_back(last.connectivity.size());
  }
  void expect_back() const {
    EncodeOptions options;
    options.order = Order::keep;
    const auto encoded = encode_bytes(mesh, options);
    ASSERT_TRUE(encoded) << encoded.error().message;
    const auto decoded = decode_bytes(encoded->bytes);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(differences_between(mesh, *decoded, true), "");
  }
};

TEST_F(HostileMesh, WithAllFacesOnOneEdge) {
  const uint32_t count = large(200000);
  points(count + 2);
  block(CellType::triangle);
  for (uint32_t i = 0; i < count; ++i) cell({i % 2, 1 - i % 2, i + 2});
  expect_back();
}

TEST_F(HostileMesh, WithAllFacesAtOnePoint) {
  const uint32_t count = large(200000);
  points(2 * count + 1);
  block(CellType::triangle);
  for (uint32_t i = 0; i < count; ++i) cell({0, 2 * i + 1, 2 * i + 2});
  expect_back();
}

TEST_F(HostileMesh, WithOneFaceManyTimes) {
  points(3);
  block(CellType::triangle);
  for (uint32_t i = 0; i < 400000; ++i) cell({0, 1, 2});
  expect_back();
}

TEST_F(HostileMesh, WithALargeFan) {
  const uint32_t count = large(300000);
  points(count + 1);
  block(CellType::triangle);
  for (uint32_t i = 0; i < count; ++i) cell({0, i + 1, (i + 1) % count + 1});
  expect_back();
}

TEST_F(HostileMesh, WithSmallFacesRoundHugeOnes) {
  constexpr uint32_t degree = 65535;
  const uint32_t faces = large(6);
  points(faces * degree + 1);
  block(CellType::polygon);
  for (uint32_t face = 0; face < faces; ++face) {
    const uint32_t first = 1 + face * degree;
    cell_of_run(first, degree);
    for (uint32_t i = 0; i < degree; ++i) cell({0, first + (i + 1) % degree, first + i});
  }
  expect_back();
}

TEST_F(HostileMesh, WithCellsOfAMillionNodes) {
  const uint32_t count = large(1000000);
  points(count);
  block(CellType::polygon);
  cell_of_run(0, count);
  block(CellType::poly_line);
  cell_of_run(0, count);
  expect_back();
}

TEST_F(HostileMesh, OfPointsOnly) {
  points(large(1000000));
  block(CellType::triangle);
  expect_back();
}

TEST_F(HostileMesh, OfManyBlocks) {
  constexpr uint32_t count = 20000;
  points(count + 2);
  for (uint32_t i = 0; i < count; ++i) {
    block(CellType::triangle);
    cell({i, i + 1, i + 2});
  }
  expect_back();
}

}  // namespace
}  // namespace maille::testing
