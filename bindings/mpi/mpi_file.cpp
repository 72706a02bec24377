#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include <maille/mpi.h>

namespace maille::mpi {
namespace {

/// MPI counts bytes in ints, so one call writes less than 2 GiB; half of that leaves room for any rounding.
constexpr uint64_t most_at_once = uint64_t{1} << 30;

/// The name that a signal handler removes. It is a plain array, because a handler must not allocate or lock.
char unfinished[4096];
volatile std::sig_atomic_t is_unfinished = 0;

std::string folder_of(const std::string& path) {
  const size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? "." : path.substr(0, slash + 1);
}

std::string text_of(int error) {
  char text[MPI_MAX_ERROR_STRING];
  int length = 0;
  MPI_Error_string(error, text, &length);
  return std::string(text, static_cast<size_t>(length));
}

/// What writing a new file and going on with one have in common.
class SharedFile : public RanksFile {
 public:
  SharedFile(MPI_Comm communicator, std::string path) : communicator_(communicator), path_(std::move(path)) {
    MPI_Comm_rank(communicator, &rank_);
  }

 protected:
  Result<> write_all(const std::string& name, int mode, std::span<const Part> parts, uint64_t size) {
    MPI_File file = MPI_FILE_NULL;
    const int opened =
        MPI_File_open(communicator_, name.c_str(), mode | MPI_MODE_WRONLY, MPI_INFO_NULL, &file);
    // It failed in some ranks, perhaps not in all; then nobody may call what needs all.
    if (auto all = agree(opened); !all) return all;
    // Every rank makes all of these collective calls even after a failure, since the others would wait for it
    // forever. The errors are compared at the end.
    int failed = MPI_File_set_size(file, static_cast<MPI_Offset>(size));
    const int written = write_parts(file, parts);
    if (failed == MPI_SUCCESS) failed = written;
    const int synced = MPI_File_sync(file);
    if (failed == MPI_SUCCESS) failed = synced;
    const int closed = MPI_File_close(&file);
    return agree(failed == MPI_SUCCESS ? closed : failed);
  }
  /// What the first rank found: a reason of the system, or 0.
  Result<> agree_with_first(int reason) const {
    MPI_Bcast(&reason, 1, MPI_INT, 0, communicator_);
    if (reason == 0) return {};
    return failure(ErrorCode::write_failed,
                   "cannot write " + path_ + ": " +
                       (reason == EWOULDBLOCK ? "somebody else is appending to it" : std::strerror(reason)));
  }

  MPI_Comm communicator_;
  std::string path_;
  int rank_ = 0;

 private:
  /// In rounds that all take part in, those who have nothing more to write, too.
  int write_parts(MPI_File file, std::span<const Part> parts) const {
    std::vector<Part> rounds;
    for (const Part& part : parts) {
      for (uint64_t at = 0; at < part.bytes.size(); at += most_at_once)
        rounds.push_back(
            {part.offset + at, part.bytes.subspan(at, std::min(most_at_once, part.bytes.size() - at))});
    }
    uint64_t count = rounds.size();
    MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_UINT64_T, MPI_MAX, communicator_);
    rounds.resize(count);
    int failed = MPI_SUCCESS;
    for (const Part& part : rounds) {
      const int result =
          MPI_File_write_at_all(file, static_cast<MPI_Offset>(part.offset), part.bytes.data(),
                                static_cast<int>(part.bytes.size()), MPI_BYTE, MPI_STATUS_IGNORE);
      if (result != MPI_SUCCESS) failed = result;
    }
    return failed;
  }

  /// Gives all ranks the error of the first rank that has one, so that they all return the same result.
  Result<> agree(int mine) {
    int size = 1;
    MPI_Comm_size(communicator_, &size);
    int first = mine == MPI_SUCCESS ? size : rank_;
    MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, communicator_);
    if (first == size) return {};
    std::array<char, MPI_MAX_ERROR_STRING> text{};
    if (rank_ == first) text_of(mine).copy(text.data(), text.size() - 1);
    MPI_Bcast(text.data(), static_cast<int>(text.size()), MPI_CHAR, first, communicator_);
    return failure(ErrorCode::write_failed,
                   "rank " + std::to_string(first) + ": cannot write " + path_ + ": " + text.data());
  }
};

class MpiFile final : public SharedFile {
 public:
  MpiFile(MPI_Comm communicator, std::string path) : SharedFile(communicator, std::move(path)) {
    // One name in all ranks.
    int process = static_cast<int>(::getpid());
    MPI_Bcast(&process, 1, MPI_INT, 0, communicator);
    const size_t name = path_.find_last_of('/') + 1;  // 0 where there is no folder
    temporary_ = path_;
    temporary_.insert(name, 1, '.');
    temporary_ += '.';
    temporary_ += std::to_string(process);
  }
  ~MpiFile() override { forget(); }
  MpiFile(const MpiFile&) = delete;
  MpiFile& operator=(const MpiFile&) = delete;

  /// Whether there can be a file of this name.
  Result<> check() {
    int reason = 0;
    if (rank_ == 0 && ::access(folder_of(path_).c_str(), W_OK) != 0) reason = errno;
    return agree_with_first(reason);
  }

  Result<> write(std::span<const Part> parts, uint64_t size) override {
    remember();
    Result<> done = write_all(temporary_, MPI_MODE_CREATE | MPI_MODE_EXCL, parts, size);
    if (!done) forget();
    return done;
  }

  Result<> commit() override {
    int reason = 0;
    if (rank_ == 0 && std::rename(temporary_.c_str(), path_.c_str()) != 0) reason = errno;
    if (rank_ == 0 && reason == 0) {
      is_unfinished = 0;
      // The new name survives a loss of power only when its folder is synced, too.
      const int folder = ::open(folder_of(path_).c_str(), O_RDONLY | O_DIRECTORY);
      if (folder >= 0) {
        ::fsync(folder);
        ::close(folder);
      }
    }
    return agree_with_first(reason);
  }

 private:
  void remember() const {
    if (rank_ != 0 || temporary_.size() >= sizeof unfinished) return;
    std::copy_n(temporary_.c_str(), temporary_.size() + 1, unfinished);
    is_unfinished = 1;
  }
  static void forget() { remove_unfinished_file(); }

  std::string temporary_;
};

/// A file that grows by a step of time. The first rank holds the lock that append_sink() takes, so that a
/// single program cannot append meanwhile, either.
class AppendedFile final : public SharedFile {
 public:
  using SharedFile::SharedFile;
  ~AppendedFile() override {
    if (lock_ >= 0) ::close(lock_);
  }
  AppendedFile(const AppendedFile&) = delete;
  AppendedFile& operator=(const AppendedFile&) = delete;

  Result<> lock() {
    int reason = 0;
    if (rank_ == 0) {
      lock_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
      if (lock_ < 0 || ::flock(lock_, LOCK_EX | LOCK_NB) != 0) reason = errno;
    }
    return agree_with_first(reason);
  }
  Result<> write(std::span<const Part> parts, uint64_t size) override {
    return write_all(path_, 0, parts, size);
  }
  /// All of it is durable already.
  Result<> commit() override { return {}; }

 private:
  int lock_ = -1;
};

}  // namespace

Result<std::unique_ptr<RanksFile>> file(MPI_Comm communicator, const std::string& path) {
  auto opened = std::make_unique<MpiFile>(communicator, path);
  if (auto ok = opened->check(); !ok) return tl::unexpected(ok.error());
  return opened;
}

Result<std::unique_ptr<RanksFile>> file_to_append(MPI_Comm communicator, const std::string& path) {
  auto opened = std::make_unique<AppendedFile>(communicator, path);
  if (auto ok = opened->lock(); !ok) return tl::unexpected(ok.error());
  return opened;
}

void remove_unfinished_file() noexcept {
  if (is_unfinished == 0) return;
  is_unfinished = 0;
  ::unlink(unfinished);
}

}  // namespace maille::mpi
