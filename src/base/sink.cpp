#include <fcntl.h>
#include <maille/source.h>
#include <sys/stat.h>
#include <array>
#include <atomic>
#include <chrono>
#include <climits>
#include <cstdio>
#include <cstdlib>

#include "base/posix.h"
#include "base/result.h"

namespace maille {
namespace {

// ---- temporary files of this process --------------------------------------------------------------------

/// One open temporary file: its folder (a descriptor, so that chdir() does not matter) and its name there.
/// A signal handler may read it at any moment, hence no allocation and the atomic state.
struct Unfinished {
  std::atomic<bool> taken{false};
  std::atomic<bool> ready{false};
  int folder = -1;
  char name[NAME_MAX + 1] = {};
};

// The only global of the library: a signal handler has no other way to know what to remove. A file beyond
// the table's size is written all the same, and merely not removed by remove_unfinished_files().
std::array<Unfinished, 64> unfinished_files;

/// Registers a temporary file while it lives. Made before the file is, so that no moment is missed.
class Registration {
 public:
  Registration(int folder, const std::string& name) {
    for (Unfinished& entry : unfinished_files) {
      if (entry.taken.exchange(true)) continue;
      entry.folder = folder;
      entry.name[name.copy(entry.name, NAME_MAX)] = '\0';
      entry.ready = true;
      entry_ = &entry;
      return;
    }
  }
  Registration(Registration&& other) noexcept : entry_(std::exchange(other.entry_, nullptr)) {}
  Registration& operator=(Registration&&) = delete;
  ~Registration() {
    if (entry_ == nullptr) return;
    entry_->ready = false;
    entry_->taken = false;
  }

 private:
  Unfinished* entry_ = nullptr;
};

// ---- writing to a descriptor ----------------------------------------------------------------------------

/// Collects small writes; hands large ones through. Remembers its first failure, so that a caller who
/// overlooks it cannot commit half a file.
class BufferedOutput {
 public:
  BufferedOutput(int fd, std::string name) : fd_(fd), name_(std::move(name)) {}

  Result<> write(Bytes bytes) {
    if (failed_ == 0 && buffer_.size() + bytes.size() < buffer_bytes) {
      buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
      return {};
    }
    MAILLE_CHECK(flush());
    return write_now(bytes);
  }

  Result<> flush() {
    MAILLE_CHECK(write_now(buffer_));
    buffer_.clear();
    return {};
  }

  const std::string& name() const { return name_; }

 private:
  static constexpr size_t buffer_bytes = size_t{64} << 10;

  Result<> write_now(Bytes bytes) {
    while (failed_ == 0 && !bytes.empty()) {
      const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
      if (written >= 0) {
        bytes = bytes.subspan(static_cast<size_t>(written));
      } else if (errno != EINTR) {
        failed_ = errno;
      }
    }
    if (failed_ == 0) return {};
    errno = failed_;
    return cannot_write(name_);
  }

  int fd_;
  std::string name_;
  std::vector<std::byte> buffer_;
  int failed_ = 0;
};

class MemorySink final : public Sink {
 public:
  explicit MemorySink(std::vector<std::byte>& out) : out_(out) {}
  Result<> write(Bytes bytes) override {
    out_.insert(out_.end(), bytes.begin(), bytes.end());
    return {};
  }
  Result<> commit() override { return {}; }
  std::string name() const override { return "<memory>"; }

 private:
  std::vector<std::byte>& out_;
};

/// Standard output, and files that are no regular ones (/dev/null, a pipe): no temporary name, no rename.
class DirectSink final : public Sink {
 public:
  DirectSink(Descriptor owned, int fd, std::string name)
      : owned_(std::move(owned)), output_(fd, std::move(name)) {}
  Result<> write(Bytes bytes) override { return output_.write(bytes); }
  Result<> commit() override { return output_.flush(); }
  std::string name() const override { return output_.name(); }

 private:
  Descriptor owned_;
  BufferedOutput output_;
};

// ---- files that appear whole or not at all --------------------------------------------------------------

struct Place {
  std::string folder;
  std::string name;
};

Place split_path(const std::string& path) {
  const size_t slash = path.rfind('/');
  if (slash == std::string::npos) return {".", path};
  return {slash == 0 ? "/" : path.substr(0, slash), path.substr(slash + 1)};
}

std::string temporary_name(const std::string& name) {
  static std::atomic<unsigned> count{0};
  const auto now =
      static_cast<unsigned long long>(std::chrono::steady_clock::now().time_since_epoch().count());
  char tail[64];
  std::snprintf(tail, sizeof tail, ".%ld-%x%08llx.part", static_cast<long>(::getpid()), count++,
                now & 0xffffffffu);
  return "." + name.substr(0, NAME_MAX - 1 - std::string_view(tail).size()) + tail;
}

/// fsync(), again after an interruption.
bool sync(int fd) {
  int result = 0;
  do {
    result = ::fsync(fd);
  } while (result != 0 && errno == EINTR);
  return result == 0;
}

class FileSink final : public Sink {
 public:
  FileSink(std::string path, Place place, Descriptor folder, Descriptor file, std::string temporary,
           Registration registration)
      : path_(std::move(path)),
        final_name_(std::move(place.name)),
        temporary_(std::move(temporary)),
        folder_(std::move(folder)),
        file_(std::move(file)),
        output_(file_.get(), path_),
        registration_(std::move(registration)) {}
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  ~FileSink() override {
    if (!committed_) ::unlinkat(folder_.get(), temporary_.c_str(), 0);
  }

  Result<> write(Bytes bytes) override { return output_.write(bytes); }

  Result<> commit() override {
    if (committed_) return {};
    MAILLE_CHECK(output_.flush());
    if (!sync(file_.get()) || !file_.close()) return cannot_write(path_);
    const char* const from = temporary_.c_str();
    if (::renameat(folder_.get(), from, folder_.get(), final_name_.c_str()) != 0) return cannot_write(path_);
    committed_ = true;
    // Some file systems cannot sync a folder, and need not.
    if (!sync(folder_.get()) && errno != EINVAL && errno != ENOTSUP) {
      return failure(ErrorCode::write_failed,
                     path_ + " is written but may not survive a power loss: its folder cannot be synced: " +
                         std::strerror(errno));
    }
    return {};
  }

  std::string name() const override { return path_; }

 private:
  std::string path_;
  std::string final_name_;
  std::string temporary_;
  Descriptor folder_;
  Descriptor file_;
  BufferedOutput output_;
  Registration registration_;
  bool committed_ = false;
};

Result<std::unique_ptr<Sink>> direct_sink(const std::string& path) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (!file.valid()) return cannot_write(path);
  const int fd = file.get();
  return std::make_unique<DirectSink>(std::move(file), fd, path);
}

/// The file a symbolic link leads to, so that writing through a link keeps the link.
std::string resolve_link(const std::string& path) {
  struct stat info {};
  if (::lstat(path.c_str(), &info) != 0 || !S_ISLNK(info.st_mode)) return path;
  char* const resolved = ::realpath(path.c_str(), nullptr);
  const std::string target = resolved == nullptr ? path : resolved;
  std::free(resolved);
  return target;
}

Result<std::unique_ptr<Sink>> replacing_sink(const std::string& path, mode_t mode, bool keep_mode) {
  const Place place = split_path(resolve_link(path));
  const std::string what = path + ": folder " + place.folder;
  Descriptor folder(::open(place.folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder.valid()) return cannot_write(what);

  for (int attempt = 0;; ++attempt) {
    std::string temporary = temporary_name(place.name);
    Registration registration(folder.get(), temporary);
    Descriptor file(::openat(folder.get(), temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
    if (file.valid()) {
      if (keep_mode) ::fchmod(file.get(), mode);  // best effort: some file systems have no modes
      return std::make_unique<FileSink>(path, place, std::move(folder), std::move(file), std::move(temporary),
                                        std::move(registration));
    }
    if (errno != EEXIST || attempt == 100) return cannot_write(what);
  }
}

}  // namespace

std::unique_ptr<Sink> memory_sink(std::vector<std::byte>& out) {
  return std::make_unique<MemorySink>(out);
}

Result<std::unique_ptr<Sink>> file_sink(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) {
    if (!path.empty() && path.back() != '/') return replacing_sink(path, 0666, false);
    errno = path.empty() ? ENOENT : EISDIR;
    return cannot_write(path.empty() ? "a file without a name" : path);
  }
  if (S_ISDIR(info.st_mode)) {
    errno = EISDIR;
    return cannot_write(path);
  }
  if (!S_ISREG(info.st_mode)) return direct_sink(path);
  // rename() would replace a write-protected file without asking.
  if (::access(path.c_str(), W_OK) != 0) return cannot_write(path);
  return replacing_sink(path, info.st_mode & 07777, true);
}

std::unique_ptr<Sink> stdout_sink() {
  return std::make_unique<DirectSink>(Descriptor(), STDOUT_FILENO, "standard output");
}

void remove_unfinished_files() noexcept {
  const int saved = errno;
  for (Unfinished& entry : unfinished_files) {
    if (entry.ready) ::unlinkat(entry.folder, entry.name, 0);
  }
  errno = saved;
}

}  // namespace maille
