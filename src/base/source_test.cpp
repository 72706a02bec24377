#include <maille/source.h>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "support/temporary_folder.h"

namespace maille {
namespace {

std::vector<std::byte> bytes_of(std::string_view text) {
  const Bytes bytes = std::as_bytes(std::span(text.data(), text.size()));
  return {bytes.begin(), bytes.end()};
}

std::string text_of(const Source& source) {
  std::string text(static_cast<size_t>(source.size()), '?');
  EXPECT_TRUE(source.read_at(0, std::as_writable_bytes(std::span(text))));
  return text;
}

class FileSource : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path(name); }
  std::string write(const std::string& name, const std::string& text) const {
    return folder_.write(name, text);
  }

  testing::TemporaryFolder folder_;
};

TEST(MemorySource, GivesBorrowedAndOwnedBytes) {
  const std::vector<std::byte> bytes = bytes_of("0123456789");
  const auto borrowed = memory_source(Bytes(bytes));
  const auto owned = memory_source(bytes_of("0123456789"), "ten");
  EXPECT_EQ(borrowed->view().data(), bytes.data());
  EXPECT_EQ(owned->view().size(), 10u);
  EXPECT_EQ(borrowed->name(), "<memory>");
  EXPECT_EQ(owned->name(), "ten");
  EXPECT_EQ(text_of(*owned), "0123456789");
  std::array<std::byte, 3> part{};
  ASSERT_TRUE(borrowed->read_at(7, part));
  EXPECT_EQ(part[0], std::byte{'7'});
}

TEST(PartSource, GivesItsBytesAlone) {
  const auto whole = memory_source(bytes_of("0123456789"), "ten");
  const auto part = part_source(*whole, 3, 4);
  ASSERT_TRUE(part);
  EXPECT_EQ((*part)->size(), 4u);
  EXPECT_EQ(text_of(**part), "3456");
  EXPECT_EQ((*part)->view().data(), whole->view().data() + 3);
  EXPECT_EQ((*part)->view().size(), 4u);
  std::array<std::byte, 2> first{}, second{};
  ASSERT_TRUE((*part)->read_many(std::array{Source::Part{0, first}, Source::Part{2, second}}));
  EXPECT_EQ(second[1], std::byte{'6'});
}

TEST(PartSource, ReachesForNothingOutside) {
  const auto whole = memory_source(bytes_of("0123456789"), "ten");
  EXPECT_FALSE(part_source(*whole, 3, 8));
  EXPECT_FALSE(part_source(*whole, 11, 0));
  EXPECT_FALSE(part_source(*whole, 1, UINT64_MAX));
  const auto part = part_source(*whole, 3, 4);
  ASSERT_TRUE(part);
  std::array<std::byte, 2> two{};
  EXPECT_FALSE((*part)->read_at(3, two));
  EXPECT_FALSE((*part)->read_at(UINT64_MAX - 2, two));
  EXPECT_FALSE((*part)->read_many(std::array{Source::Part{0, two}, Source::Part{3, two}}));
  EXPECT_TRUE((*part_source(*whole, 10, 0))->view().empty());
}

TEST(MemorySource, RefusesToReadBehindTheEnd) {
  const auto source = memory_source(bytes_of("0123456789"), "ten");
  std::array<std::byte, 3> part{};
  EXPECT_TRUE(source->read_at(10, {}));
  EXPECT_FALSE(source->read_at(8, part));
  EXPECT_FALSE(source->read_at(11, {}));
  const auto far = source->read_at(UINT64_MAX, part);
  ASSERT_FALSE(far);
  EXPECT_EQ(far.error().code, ErrorCode::cannot_read);
  EXPECT_EQ(source->read_at(8, part).error().message,
            "ten: bytes 8..11 were asked for, but it ends at byte 10");
}

TEST_F(FileSource, ReadsAFile) {
  const auto source = file_source(write("a", "some text"));
  ASSERT_TRUE(source);
  EXPECT_EQ((*source)->size(), 9u);
  EXPECT_EQ((*source)->name(), path("a"));
  EXPECT_EQ(text_of(**source), "some text");
  std::array<std::byte, 1> part{};
  EXPECT_FALSE((*source)->read_at(9, part));
}

TEST_F(FileSource, ReadsAnEmptyFile) {
  const auto source = file_source(write("a", ""));
  ASSERT_TRUE(source);
  EXPECT_EQ((*source)->size(), 0u);
}

TEST_F(FileSource, ReadsFilesThatClaimNoSize) {
  const auto source = file_source("/proc/self/status");
  ASSERT_TRUE(source);
  EXPECT_THAT(text_of(**source), ::testing::HasSubstr("Pid:"));
}

TEST_F(FileSource, ReadsAPipeToItsEnd) {
  ASSERT_EQ(::mkfifo(path("fifo").c_str(), 0600), 0);
  const std::string text(300000, 'x');
  std::thread writer([&] { std::ofstream(path("fifo"), std::ios::binary) << text; });
  const auto source = file_source(path("fifo"));
  writer.join();
  ASSERT_TRUE(source);
  EXPECT_EQ(text_of(**source), text);
}

TEST_F(FileSource, SaysWhyAFileCannotBeRead) {
  EXPECT_EQ(file_source("no/such.ply").error().message, "cannot read no/such.ply: No such file or directory");
  EXPECT_EQ(file_source("no/such.ply").error().code, ErrorCode::cannot_read);
  EXPECT_EQ(file_source(folder_.path()).error().message,
            "cannot read " + folder_.path() + ": Is a directory");
  EXPECT_EQ(file_source("").error().message, "cannot read : No such file or directory");
}

TEST_F(FileSource, SaysWhenPermissionIsMissing) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may read everything";
  ASSERT_EQ(::chmod(write("a", "text").c_str(), 0), 0);
  EXPECT_EQ(file_source(path("a")).error().message, "cannot read " + path("a") + ": Permission denied");
}

TEST_F(FileSource, ReadsStandardInputToItsEnd) {
  const int saved = ::dup(STDIN_FILENO);
  const int file = ::open(write("in", "from standard input").c_str(), O_RDONLY);
  ASSERT_EQ(::dup2(file, STDIN_FILENO), STDIN_FILENO);
  const auto source = stdin_source();
  ::dup2(saved, STDIN_FILENO);
  ::close(saved);
  ::close(file);
  ASSERT_TRUE(source);
  EXPECT_EQ(text_of(**source), "from standard input");
  EXPECT_EQ((*source)->name(), "standard input");
}

}  // namespace
}  // namespace maille
