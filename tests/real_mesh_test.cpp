#include "support/codec.h"
#include "support/data.h"

#include <maille/io.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

namespace maille::testing {
namespace {

/// All surfaces of the shared data (or of packages) that a reader exists for, largest first.
std::vector<std::string> surface_files() {
  std::vector<std::string> files;
  for (const char* folder : {"tri", "poly", "terrain", "textured"}) {
    for (const std::string& file : data_files(folder)) {
      const std::string extension = std::filesystem::path(file).extension().string();
      if (extension != ".mz3" && extension != ".b3dm") files.push_back(file);
    }
  }
  std::stable_sort(files.begin(), files.end(), [](const std::string& x, const std::string& y) {
    return std::filesystem::file_size(x) > std::filesystem::file_size(y);
  });
  return files;
}

/// Every eighth file: ctest runs the shards at once, each with large and small files.
class RealMeshes : public ::testing::TestWithParam<size_t> {
 protected:
  static constexpr size_t shards = 8;

  void SetUp() override {
    const std::vector<std::string> all = surface_files();
    if (all.empty()) GTEST_SKIP() << "no real meshes in build/data; scripts/data fetches some";
    for (size_t i = GetParam(); i < all.size(); i += shards) files_.push_back(all[i]);
  }

  /// Reads each file and hands it to `work`.
  template <class Work>
  void for_each_mesh(Work work) {
    for (const std::string& file : files_) {
      SCOPED_TRACE(file);
      const auto read = read_mesh(file);
      ASSERT_TRUE(read) << read.error().message;
      ASSERT_TRUE(validate(read->mesh));
      ASSERT_GT(read->mesh.point_count(), 0u);
      work(read->mesh);
    }
  }

  std::vector<std::string> files_;
};
INSTANTIATE_TEST_SUITE_P(Shard, RealMeshes, ::testing::Range<size_t>(0, 8));

/// Encodes, decodes, and compares bit for bit.
void expect_back(const Mesh& mesh, const EncodeOptions& options) {
  const auto encoded = encode_bytes(mesh, options);
  ASSERT_TRUE(encoded) << encoded.error().message;
  const auto decoded = decode_bytes(encoded->bytes);
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(differences_between(mesh, *decoded, options.order == Order::keep), "");
}

TEST_P(RealMeshes, ComeBackExactly) {
  for_each_mesh([](const Mesh& mesh) { expect_back(mesh, {}); });
}

TEST_P(RealMeshes, ComeBackInOrder) {
  EncodeOptions options;
  options.order = Order::keep;
  for_each_mesh([&](const Mesh& mesh) { expect_back(mesh, options); });
}

TEST_P(RealMeshes, KeepTheBoundAndRepeatTheirBytes) {
  EncodeOptions options;
  options.positions = {Tolerance::Kind::relative, 1e-4};
  for_each_mesh([&](const Mesh& mesh) {
    const auto once = encode_bytes(mesh, options);
    ASSERT_TRUE(once) << once.error().message;
    // Small whole coordinates, as in CGAL's P.off, are kept exactly: a bound of 0, so no error at all.
    EXPECT_GE(once->report.positions.bound, 0);
    EXPECT_LE(once->report.positions.maximum_error, once->report.positions.bound);
    const auto decoded = decode_bytes(once->bytes);
    ASSERT_TRUE(decoded) << decoded.error().message;
    const auto twice = encode_bytes(*decoded, options);
    ASSERT_TRUE(twice) << twice.error().message;
    EXPECT_TRUE(once->bytes == twice->bytes || is_glued_by_choice(mesh) || has_twins(*decoded));
  });
}

}  // namespace
}  // namespace maille::testing
