#include "base/opened_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <filesystem>
#include <fstream>

#include "support/temporary_folder.h"

namespace maille {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

TEST(OpenedFile, IsRegularAndInTheFolderOrBelow) {
  const testing::TemporaryFolder folder;
  fs::create_directory(folder.path("in"));
  folder.write("in/a", "a");
  fs::create_symlink("a", folder.path("in/link"));
  EXPECT_TRUE(open_beneath(folder.path(), "in/a"));
  EXPECT_TRUE(open_beneath(folder.path("in"), "link")) << "a link that stays in the folder";
  EXPECT_EQ(open_beneath(folder.path(), "in").error().code, ErrorCode::cannot_read);
  EXPECT_EQ(open_beneath(folder.path(), "nothing").error().code, ErrorCode::cannot_read);
}

TEST(OpenedFile, IsNotBehindALinkOrANameThatLeavesTheFolder) {
  const testing::TemporaryFolder folder;
  fs::create_directory(folder.path("in"));
  folder.write("secret", "s");
  fs::create_symlink("../secret", folder.path("in/up"));
  fs::create_symlink(folder.path("secret"), folder.path("in/absolute"));
  fs::create_directory_symlink("..", folder.path("in/around"));
  for (const char* name : {"up", "absolute", "around/secret", "../secret", "/etc/passwd"}) {
    const auto opened = open_beneath(folder.path("in"), name);
    ASSERT_FALSE(opened) << name;
    EXPECT_THAT(opened.error().message, HasSubstr("leads out of the folder")) << name;
  }
}

TEST(OpenedFile, DoesNotWaitForPipesAndDevices) {
  const testing::TemporaryFolder folder;
  ASSERT_EQ(::mkfifo(folder.path("pipe").c_str(), 0600), 0);
  fs::create_symlink("/dev/zero", folder.path("zero"));
  EXPECT_THAT(open_beneath(folder.path(), "pipe").error().message, HasSubstr("no regular file"));
  EXPECT_FALSE(open_beneath(folder.path(), "zero"));
  EXPECT_THAT(open_beneath("/dev", "zero").error().message, HasSubstr("no regular file"));
}

TEST(OpenedFile, ThatIsCutWhileItIsReadIsAnError) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.write("f", std::string(100000, 'x'));
  for (const auto open : {file_source, unmapped_source}) {
    const auto source = open(path);
    ASSERT_TRUE(source);
    EXPECT_TRUE((*source)->view().empty()) << "a map of a file that is cut ends the process";
    std::vector<std::byte> bytes(100000);
    ASSERT_TRUE((*source)->read_at(0, bytes));
    fs::resize_file(path, 5000);
    const auto read = (*source)->read_at(0, bytes);
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, HasSubstr("became shorter"));
    folder.write("f", std::string(100000, 'x'));
  }
}

}  // namespace
}  // namespace maille
