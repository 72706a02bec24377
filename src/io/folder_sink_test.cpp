#include "io/folder_sink.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "support/temporary_folder.h"

namespace maille {
namespace {

namespace fs = std::filesystem;

class FolderSinkTest : public ::testing::Test {
 protected:
  /// A folder with a file, two minutes old.
  std::string left(const std::string& name) {
    const std::string path = folder_.path(name);
    fs::create_directory(path);
    std::ofstream(path + "/points") << "half";
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::minutes(2));
    return path;
  }
  testing::TemporaryFolder folder_;
};

TEST_F(FolderSinkTest, RemovesWhatAKilledProcessLeftOfTheSameFolder) {
  const std::string killed = left(".polyMesh.12-0000000af.part");
  const std::string other = left(".points.12-0000000af.part");
  const std::string older = left(".polyMesh.12-0000000af.part.old");
  const std::string named = left(".polyMesh.mine.part");
  { ASSERT_TRUE(folder_sink(folder_.path("polyMesh"), {}, "polyMesh")); }
  EXPECT_FALSE(fs::exists(killed));
  EXPECT_TRUE(fs::exists(other));
  EXPECT_TRUE(fs::exists(older)) << "a mesh that was to be replaced";
  EXPECT_TRUE(fs::exists(named));
}

TEST_F(FolderSinkTest, LeavesWhatAnotherOneIsWriting) {
  const auto first = folder_sink(folder_.path("polyMesh"), {}, "polyMesh");
  ASSERT_TRUE(first.has_value() && (*first)->begin_file("points").has_value());
  ASSERT_EQ(folder_.names().size(), 1u);
  const fs::path writing = fs::directory_iterator(folder_.path())->path();
  fs::last_write_time(writing, fs::file_time_type::clock::now() - std::chrono::minutes(2));
  { ASSERT_TRUE(folder_sink(folder_.path("polyMesh"), {}, "polyMesh")); }
  EXPECT_EQ(folder_.names().size(), 1u);
  EXPECT_TRUE((*first)->commit());
  EXPECT_TRUE(fs::exists(folder_.path("polyMesh/points")));
}

}  // namespace
}  // namespace maille
