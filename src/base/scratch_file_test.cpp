#include "base/scratch_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/region_file.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

Bytes bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

TEST(ScratchFile, GivesBackWhatWasAppendedAndOverwritten) {
  auto file = ScratchFile::create("");
  ASSERT_TRUE(file);
  const std::string large(100'000, 'x');
  ASSERT_TRUE(file->append(bytes_of("begin")));
  ASSERT_TRUE(file->append(bytes_of(large)));
  ASSERT_TRUE(file->append(bytes_of("end")));
  ASSERT_TRUE(file->write_at(1, bytes_of("EGI")));
  EXPECT_EQ(file->size(), large.size() + 8);
  std::string back(file->size(), '?');
  ASSERT_TRUE(file->read_at(0, std::as_writable_bytes(std::span(back.data(), back.size()))));
  EXPECT_EQ(back, "bEGIn" + large + "end");
  EXPECT_FALSE(file->read_at(4, std::as_writable_bytes(std::span(back.data(), back.size()))));
}

TEST(ScratchFile, HasNoNameInItsFolder) {
  const testing::TemporaryFolder folder;
  auto file = ScratchFile::create(folder.path());
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->write_at(0, bytes_of("something")));
  EXPECT_TRUE(folder.names().empty());
  const auto missing = ScratchFile::create(folder.path("none"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::write_failed);
  EXPECT_NE(missing.error().message.find(folder.path("none")), std::string::npos);
}

TEST(UnmappedSource, ReadsWhatIsInTheFile) {
  const testing::TemporaryFolder folder;
  const auto source = unmapped_source(folder.write("a", "0123456789"));
  ASSERT_TRUE(source);
  EXPECT_EQ((*source)->size(), 10u);
  EXPECT_TRUE((*source)->view().empty());
  std::string part(4, '?');
  ASSERT_TRUE((*source)->read_at(3, std::as_writable_bytes(std::span(part.data(), 4))));
  EXPECT_EQ(part, "3456");
  EXPECT_FALSE((*source)->read_at(7, std::as_writable_bytes(std::span(part.data(), 4))));
  EXPECT_FALSE(unmapped_source(folder.path("none")));
}

TEST(SpooledSource, HoldsAllOfAPipe) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  ASSERT_EQ(write(ends[1], "piped", 5), 5);
  close(ends[1]);
  const auto source = spooled_source(ends[0], "pipe");
  close(ends[0]);
  ASSERT_TRUE(source);
  std::string back(5, '?');
  ASSERT_TRUE((*source)->read_at(0, std::as_writable_bytes(std::span(back.data(), 5))));
  EXPECT_EQ(back, "piped");
  EXPECT_FALSE((*source)->read_at(3, std::as_writable_bytes(std::span(back.data(), 5))));
}

TEST(RegionFile, AppearsWholeOrNotAtAll) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path("a");
  {
    RegionFile file(path);
    ASSERT_TRUE(file.open());
    ASSERT_TRUE(file.write_at(3, bytes_of("def")));
    EXPECT_FALSE(folder.names().contains("a"));
  }
  EXPECT_TRUE(folder.names().empty()) << "an unfinished file is removed";
  {
    RegionFile file(path);
    ASSERT_TRUE(file.open());
    remove_unfinished_files();
    EXPECT_TRUE(folder.names().empty()) << "as on an interruption";
  }
  RegionFile file(path);
  ASSERT_TRUE(file.open());
  ASSERT_TRUE(file.write_at(3, bytes_of("def")));
  ASSERT_TRUE(file.write_at(0, bytes_of("abc")));
  ASSERT_TRUE(file.commit());
  EXPECT_EQ(folder.read("a"), "abcdef");
}

}  // namespace
}  // namespace maille
