#include "support/codec.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

#include <gtest/gtest.h>

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

/// Small files of all kinds: nothing, faces only, all arrays, order kept, lossy.
std::vector<File> small_files() {
  std::vector<File> files;
  files.push_back(file_of("empty", Mesh{}));
  files.push_back(file_of("cube", cube()));
  EncodeOptions options;
  options.positions = {Tolerance::Kind::bits, 10};
  files.push_back(file_of("torus at 10 bits", torus(9, 6), options));
  options.order = Order::keep;
  files.push_back(file_of("sphere in order", shuffled(sphere(9, 6), 1), options));
  for (uint64_t seed = 0; seed < 200 && files.size() < 10; ++seed) {
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
    for (int i = 0; i < 1000; ++i) {
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
    for (int i = 0; i < 300; ++i) {
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
    for (int i = 0; i < 200; ++i) {
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
  for (int i = 0; i < 500; ++i) {
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

}  // namespace
}  // namespace maille::testing
