#include <maille/source.h>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/time.h>
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
using ::testing::HasSubstr;

std::vector<std::byte> bytes_of(std::string_view text) {
  const Bytes bytes = std::as_bytes(std::span(text.data(), text.size()));
  return {bytes.begin(), bytes.end()};
}

class FileSink : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return temporary_.path(name); }
  std::string read(const std::string& name) const { return temporary_.read(name); }
  std::set<std::string> names() const { return temporary_.names(); }

  /// Runs `work` in a child process; its exit status as of waitpid().
  template <class Work>
  static int in_child(Work work) {
    const pid_t child = ::fork();
    if (child == 0) {
      work();
      ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return status;
  }

  testing::TemporaryFolder temporary_;
  const std::string& folder_ = temporary_.path();
};

std::string message(const Result<>& result) {
  return result ? "" : result.error().message;
}

TEST(MemorySink, Appends) {
  std::vector<std::byte> out = bytes_of("a");
  const auto sink = memory_sink(out);
  EXPECT_TRUE(sink->write(bytes_of("bc")));
  EXPECT_TRUE(sink->write({}));
  EXPECT_TRUE(sink->commit());
  EXPECT_EQ(out, bytes_of("abc"));
}

TEST_F(FileSink, WritesSmallAndLargePiecesInOrder) {
  std::string expected;
  {
    const auto sink = file_sink(path("a"));
    ASSERT_TRUE(sink);
    for (const size_t size : {1u, 5u, 70000u, 3u, 65535u, 1u, 1u, 65536u, 200000u, 0u, 2u}) {
      const std::string piece(size, static_cast<char>('a' + size % 26));
      ASSERT_TRUE((*sink)->write(bytes_of(piece)));
      expected += piece;
    }
    EXPECT_EQ((*sink)->name(), path("a"));
    ASSERT_TRUE((*sink)->commit());
  }
  EXPECT_EQ(read("a"), expected);
  EXPECT_EQ(names(), std::set<std::string>{"a"});
}

TEST_F(FileSink, ShowsNothingBeforeCommit) {
  {
    const auto sink = file_sink(path("a"));
    ASSERT_TRUE(sink);
    ASSERT_TRUE((*sink)->write(bytes_of(std::string(100000, 'x'))));
    EXPECT_FALSE(fs::exists(path("a")));
  }
  EXPECT_TRUE(names().empty());
}

TEST_F(FileSink, KeepsTheOldFileUntilCommit) {
  std::ofstream(path("a")) << "old";
  ASSERT_EQ(::chmod(path("a").c_str(), 0640), 0);
  {
    const auto sink = file_sink(path("a"));
    ASSERT_TRUE((*sink)->write(bytes_of("new, given up")));
  }
  EXPECT_EQ(read("a"), "old");
  const auto sink = file_sink(path("a"));
  ASSERT_TRUE((*sink)->write(bytes_of("new")));
  EXPECT_EQ(read("a"), "old");
  ASSERT_TRUE((*sink)->commit());
  EXPECT_EQ(read("a"), "new");
  struct stat info {};
  ASSERT_EQ(::stat(path("a").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777u, 0640u);
  EXPECT_EQ(names(), std::set<std::string>{"a"});
}

TEST_F(FileSink, NewFilesFollowTheUmask) {
  const mode_t saved = ::umask(027);
  ASSERT_TRUE((*file_sink(path("a")))->commit());
  ::umask(saved);
  struct stat info {};
  ASSERT_EQ(::stat(path("a").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777u, 0640u);
}

TEST_F(FileSink, WritesThroughASymbolicLink) {
  fs::create_directory(path("d"));
  std::ofstream(path("d/target")) << "old";
  fs::create_symlink("d/target", path("link"));
  const auto sink = file_sink(path("link"));
  ASSERT_TRUE((*sink)->write(bytes_of("new")));
  ASSERT_TRUE((*sink)->commit());
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(read("d/target"), "new");
}

TEST_F(FileSink, AcceptsTheLongestName) {
  const std::string longest(255, 'n');
  const auto sink = file_sink(path(longest));
  ASSERT_TRUE(sink) << sink.error().message;
  ASSERT_TRUE((*sink)->commit());
  EXPECT_EQ(names(), std::set<std::string>{longest});
}

TEST_F(FileSink, FollowsItsFolderNotTheCurrentOne) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  const auto kept = file_sink("a");
  auto dropped = file_sink("b");
  fs::current_path(before);
  ASSERT_TRUE((*kept)->commit());
  dropped->reset();
  EXPECT_EQ(names(), std::set<std::string>{"a"});
}

TEST_F(FileSink, SaysWhyItCannotStart) {
  EXPECT_EQ(file_sink(path("no/a")).error().message,
            "cannot write " + path("no/a") + ": folder " + path("no") + ": No such file or directory");
  EXPECT_EQ(file_sink(path("no/a")).error().code, ErrorCode::write_failed);
  EXPECT_EQ(file_sink(folder_).error().message, "cannot write " + folder_ + ": Is a directory");
  EXPECT_EQ(file_sink(folder_ + "/").error().message, "cannot write " + folder_ + "/: Is a directory");
  EXPECT_EQ(file_sink(path("no/")).error().message, "cannot write " + path("no/") + ": Is a directory");
  EXPECT_EQ(file_sink("").error().message, "cannot write a file without a name: No such file or directory");
  std::ofstream(path("file")) << "";
  EXPECT_THAT(file_sink(path("file/a")).error().message, HasSubstr("Not a directory"));
  EXPECT_EQ(names(), std::set<std::string>{"file"});
}

TEST_F(FileSink, SaysWhenPermissionIsMissing) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  std::ofstream(path("read-only")) << "old";
  ASSERT_EQ(::chmod(path("read-only").c_str(), 0444), 0);
  EXPECT_EQ(file_sink(path("read-only")).error().message,
            "cannot write " + path("read-only") + ": Permission denied");
  ASSERT_EQ(::chmod(folder_.c_str(), 0555), 0);
  EXPECT_EQ(file_sink(path("a")).error().message,
            "cannot write " + path("a") + ": folder " + folder_ + ": Permission denied");
  ASSERT_EQ(::chmod(folder_.c_str(), 0755), 0);
}

TEST_F(FileSink, WritesDevicesStraight) {
  const auto null = file_sink("/dev/null");
  ASSERT_TRUE(null);
  EXPECT_TRUE((*null)->write(bytes_of("gone")));
  EXPECT_TRUE((*null)->commit());
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(FileSink, ReportsAFullDisk) {
  const auto full = file_sink("/dev/full");
  ASSERT_TRUE(full);
  EXPECT_TRUE((*full)->write(bytes_of("small pieces wait")));
  EXPECT_EQ(message((*full)->commit()), "cannot write /dev/full: No space left on device");
  EXPECT_EQ(message((*full)->commit()), "cannot write /dev/full: No space left on device");
  EXPECT_EQ(message((*full)->write(bytes_of(std::string(100000, 'x')))),
            "cannot write /dev/full: No space left on device");
}

TEST_F(FileSink, LeavesNothingWhenTheFileGrowsTooLarge) {
  const int status = in_child([&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit = {100000, 100000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    auto sink = *file_sink(path("a"));
    if (!sink->write(bytes_of(std::string(90000, 'x')))) ::_exit(1);
    const auto second = sink->write(bytes_of(std::string(90000, 'x')));
    if (second || second.error().message != "cannot write " + path("a") + ": File too large") ::_exit(2);
    if (sink->write(bytes_of("small"))) ::_exit(3);  // an error stays
    if (sink->commit()) ::_exit(4);
    sink.reset();
  });
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(names().empty());
}

TEST_F(FileSink, WritesToStandardOutput) {
  const int status = in_child([&] {
    const int file = ::open(path("out").c_str(), O_WRONLY | O_CREAT, 0600);
    ::dup2(file, STDOUT_FILENO);
    const auto sink = stdout_sink();
    if (!sink->write(bytes_of("answer")) || !sink->commit() || sink->name() != "standard output") ::_exit(1);
  });
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read("out"), "answer");
}

TEST_F(FileSink, ReportsABrokenPipe) {
  const int status = in_child([] {
    std::signal(SIGPIPE, SIG_IGN);
    int ends[2];
    if (::pipe(ends) != 0) ::_exit(1);
    ::close(ends[0]);
    ::dup2(ends[1], STDOUT_FILENO);
    const auto sink = stdout_sink();
    if (!sink->write(bytes_of("x"))) ::_exit(2);
    if (message(sink->commit()) != "cannot write standard output: Broken pipe") ::_exit(3);
  });
  EXPECT_EQ(status, 0);
}

// Else a file of mode stream whose step could not be written whole would be found damaged.
TEST_F(FileSink, ThatAppendsCutsOffWhatWasNotCommitted) {
  const std::string file = path("appended");
  std::ofstream(file) << "whole";
  const std::string tail(200000, 'x');  // more than the sink keeps
  {
    const auto sink = append_sink(file, 5);
    ASSERT_TRUE(sink.has_value() && (*sink)->write(bytes_of(tail)).has_value());
    EXPECT_GT(fs::file_size(file), 5u);
  }
  EXPECT_EQ(fs::file_size(file), 5u);
  {
    const auto sink = append_sink(file, 5);
    ASSERT_TRUE(sink.has_value() && (*sink)->write(bytes_of(tail)).has_value() &&
                (*sink)->commit().has_value());
  }
  EXPECT_EQ(fs::file_size(file), 5u + tail.size());
}

TEST_F(FileSink, ThatAppendsCutsOffWhatCouldNotBeWritten) {
  const std::string file = path("appended");
  std::ofstream(file) << "whole";
  const int status = in_child([&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit = {100000, 100000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    auto sink = *append_sink(file, 5);
    if (sink->write(bytes_of(std::string(200000, 'x')))) ::_exit(1);
    if (fs::file_size(file) != 100000) ::_exit(2);
    if (sink->write(bytes_of("small"))) ::_exit(3);  // an error stays
    if (sink->commit()) ::_exit(4);
    sink.reset();
  });
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read("appended"), "whole");
}

TEST_F(FileSink, SurvivesInterruptedWrites) {
  // A slow pipe and a timer whose handler does not restart calls: writes come back short or with EINTR.
  ASSERT_EQ(::mkfifo(path("fifo").c_str(), 0600), 0);
  const std::string text(2000000, 'y');
  const pid_t child = ::fork();
  if (child == 0) {
    struct sigaction action {};
    action.sa_handler = [](int) {};
    ::sigaction(SIGALRM, &action, nullptr);
    const auto sink = file_sink(path("fifo"));
    const itimerval interval = {{0, 500}, {0, 500}};
    ::setitimer(ITIMER_REAL, &interval, nullptr);
    ::_exit(sink && (*sink)->write(bytes_of(text)) && (*sink)->commit() ? 0 : 1);
  }
  std::string received;
  const int file = ::open(path("fifo").c_str(), O_RDONLY);
  std::array<char, 1000> piece;
  for (ssize_t got; (got = ::read(file, piece.data(), piece.size())) > 0;) {
    received.append(piece.data(), static_cast<size_t>(got));
    if (received.size() % 50000 == 0) ::usleep(1000);
  }
  ::close(file);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(received == text);
}

TEST_F(FileSink, AKilledProcessLeavesTheOldFileOrTheNewOne) {
  const std::string before(300000, 'o'), after(400000, 'n');
  int old_files = 0;
  for (uint64_t trial = 0; trial < maille::testing::cases(200); ++trial) {
    std::ofstream(path("a"), std::ios::binary) << before;
    const pid_t child = ::fork();
    if (child == 0) {
      const auto sink = file_sink(path("a"));
      for (size_t at = 0; at < after.size(); at += 1000) {
        if (!(*sink)->write(bytes_of(std::string_view(after).substr(at, 1000)))) ::_exit(1);
      }
      ::_exit((*sink)->commit() ? 0 : 1);
    }
    ::usleep(static_cast<useconds_t>(trial * 37 % 3000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const std::string found = read("a");
    ASSERT_TRUE(found == before || found == after) << "after trial " << trial;
    old_files += found == before ? 1 : 0;
  }
  EXPECT_GT(old_files, 0);  // some were killed in time
}

TEST_F(FileSink, ManyCanBeOpenAtOnce) {
  std::vector<std::unique_ptr<Sink>> sinks;
  for (int i = 0; i < 100; ++i) {
    auto sink = file_sink(path(std::to_string(i)));
    ASSERT_TRUE(sink);
    sinks.push_back(*std::move(sink));
  }
  for (size_t i = 0; i < 50; ++i) EXPECT_TRUE(sinks[i]->commit());
  sinks.clear();
  EXPECT_EQ(names().size(), 50u);
}

}  // namespace
}  // namespace maille
