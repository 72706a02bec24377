#include "base/pending_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>

#include "support/cases.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;
using Naming = PendingFile::Naming;

class PendingFiles : public ::testing::TestWithParam<Naming> {
 protected:
  std::string path() const { return folder_.path("a"); }
  std::unique_ptr<PendingFile> create() const { return PendingFile::create(path(), {}, GetParam()).value(); }
  Names names() const { return folder_.names(); }
  std::string content() const { return folder_.read("a"); }
  /// Whether files may be without names here.
  bool nameless() const {
#ifdef O_TMPFILE
    return Descriptor(::open(folder_.path().c_str(), O_TMPFILE | O_WRONLY, 0600)).valid();
#else
    return false;
#endif
  }

  testing::TemporaryFolder folder_;
};

bool put(const PendingFile& file, const std::string& text) {
  return ::write(file.descriptor(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
}

TEST_P(PendingFiles, AppearWholeAndReplaceWhatWasThere) {
  for (const std::string text : {"first", "second"}) {
    const std::string before = content();
    const auto file = create();
    ASSERT_TRUE(put(*file, text));
    EXPECT_EQ(content(), before);
    ASSERT_TRUE(file->commit());
    EXPECT_TRUE(file->commit()) << "once more is nothing";
    EXPECT_EQ(content(), text);
    EXPECT_EQ(names(), Names{"a"});
  }
}

TEST_P(PendingFiles, HaveANameMeanwhileOnlyWhereTheyMust) {
  const auto file = create();
  const bool none = GetParam() == Naming::late && nameless();
  EXPECT_EQ(names().size(), none ? 0u : 1u);
  EXPECT_FALSE(names().contains("a"));
}

TEST_P(PendingFiles, LeaveNothingWhenGivenUp) {
  ASSERT_TRUE(put(*create(), "x"));
  EXPECT_EQ(names(), Names());
}

TEST_P(PendingFiles, LeaveNothingWhenASignalHandlerRemovesThem) {
  const pid_t child = ::fork();
  if (child == 0) {
    const auto file = create();
    remove_unfinished_files();
    ::_exit(names().empty() ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

TEST_P(PendingFiles, GiveWayToAFolderWithAnError) {
  fs::create_directory(path());
  std::ofstream(path() + "/inside") << "kept";
  EXPECT_FALSE(create()->commit());
  EXPECT_EQ(names(), Names{"a"});
}

TEST_P(PendingFiles, HaveTheModeThatIsAskedFor) {
  const mode_t saved = ::umask(077);
  const auto file = PendingFile::create(path(), 0646, GetParam());
  ::umask(saved);
  ASSERT_TRUE((*file)->commit());
  struct stat info {};
  ASSERT_EQ(::stat(path().c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777u, 0646u);
}

INSTANTIATE_TEST_SUITE_P(Both, PendingFiles, ::testing::Values(Naming::late, Naming::early),
                         [](const auto& info) { return info.param == Naming::late ? "Late" : "Early"; });

using KilledProcess = PendingFiles;

TEST_P(KilledProcess, LeavesTheWholeFileOrNothing) {
  if (!nameless()) GTEST_SKIP() << "files have names here";
  const std::string text(300000, 'n');
  int nothing = 0;
  for (uint64_t trial = 0; trial < testing::cases(200); ++trial) {
    const pid_t child = ::fork();
    if (child == 0) {
      const auto file = create();
      for (size_t at = 0; at < text.size(); at += 1000) put(*file, text.substr(at, 1000));
      ::_exit(file->commit() ? 0 : 1);
    }
    ::usleep(static_cast<useconds_t>(trial * 37 % 3000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    ASSERT_TRUE(names().empty() || (names() == Names{"a"} && content() == text)) << "after trial " << trial;
    nothing += names().empty() ? 1 : 0;
    fs::remove(path());
  }
  EXPECT_GT(nothing, 0);  // some were killed in time
}

INSTANTIATE_TEST_SUITE_P(Late, KilledProcess, ::testing::Values(Naming::late),
                         [](const auto&) { return "Late"; });

}  // namespace
}  // namespace maille
