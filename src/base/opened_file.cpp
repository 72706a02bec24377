#include "base/opened_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <algorithm>
#include <cstdlib>
#include <memory>

#if __has_include(<linux/openat2.h>)
#include <linux/openat2.h>
#endif

#include "base/result.h"
#include "base/source_range.h"

namespace maille {
namespace {

/// A regular file, read with pread(), which has no place of its own: several threads may read at once. The
/// size is that at opening; a file cut meanwhile is an error, and one that grew is read up to the old size.
class FileSource final : public Source {
 public:
  FileSource(Descriptor file, uint64_t size, std::string path)
      : file_(std::move(file)), size_(size), path_(std::move(path)) {}

  uint64_t size() const override { return size_; }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    MAILLE_CHECK(check_range(*this, offset, out.size()));
    while (!out.empty()) {
      const ssize_t count = ::pread(file_.get(), out.data(), out.size(), static_cast<off_t>(offset));
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) return cannot_read(path_);
      if (count == 0) return failure(ErrorCode::cannot_read, path_ + " became shorter while it was read");
      offset += static_cast<uint64_t>(count);
      out = out.subspan(static_cast<size_t>(count));
    }
    return {};
  }
  std::string name() const override { return path_; }

 private:
  Descriptor file_;
  uint64_t size_;
  std::string path_;
};

std::string shown(const std::string& folder, const std::string& name) {
  return folder == "." ? name : folder + "/" + name;
}

tl::unexpected<Error> not_beneath(const std::string& folder, const std::string& name, const char* why) {
  return failure(ErrorCode::cannot_read, "cannot read " + shown(folder, name) + ": " + why);
}

constexpr const char* leads_out = "it is a link that leads out of the folder; put the file itself there";
// Without O_NONBLOCK, opening a pipe would wait for a writer before fstat() can refuse it.
constexpr int opening_flags = O_RDONLY | O_CLOEXEC | O_NONBLOCK;

/// What the kernel itself keeps within the folder. Not there (before Linux 5.6, in some containers, on other
/// systems): -1 with errno ENOSYS.
int open_by_kernel([[maybe_unused]] int folder, [[maybe_unused]] const std::string& name) {
#ifdef SYS_openat2
  open_how how{};
  how.flags = opening_flags;
  // Links below /proc/self/fd lead to files without naming their paths, so they are refused as well.
  how.resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS;
  const long file = ::syscall(SYS_openat2, folder, name.c_str(), &how, sizeof how);
  // Containers whose filters do not know the call answer EPERM.
  if (file >= 0 || errno != EPERM) return static_cast<int>(file);
#endif
  errno = ENOSYS;
  return -1;
}

std::string real_path(const std::string& path) {
  const std::unique_ptr<char, decltype(&std::free)> real(::realpath(path.c_str(), nullptr), std::free);
  return real ? std::string(real.get()) : std::string();
}

/// The same where the kernel does not help: somebody who changes links at this moment is not noticed.
/// realpath() and open() are two calls; O_NOFOLLOW narrows the gap to the folders of the path.
Result<Descriptor> open_by_path(const std::string& folder, const std::string& name) {
  const std::string file = real_path(folder + "/" + name), root = real_path(folder);
  if (file.empty() || root.empty()) return cannot_read(shown(folder, name));
  if (!file.starts_with(root == "/" ? root : root + "/")) return not_beneath(folder, name, leads_out);
  Descriptor opened(::open(file.c_str(), opening_flags | O_NOFOLLOW));
  if (!opened.valid()) return cannot_read(shown(folder, name));
  return opened;
}

Result<Descriptor> open_anything_beneath(const std::string& folder, const std::string& name) {
  const Descriptor root(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!root.valid()) return cannot_read(shown(folder, name));
  Descriptor file(open_by_kernel(root.get(), name));
  if (file.valid()) return file;
  if (errno == ENOSYS) return open_by_path(folder, name);
  if (errno == EXDEV) return not_beneath(folder, name, leads_out);
  return cannot_read(shown(folder, name));
}

}  // namespace

// 0 also for pipes and devices, whose sizes say nothing about the bytes they will give.
Result<uint64_t> plain_size(int file, const std::string& path) {
  struct stat info {};
  if (::fstat(file, &info) != 0) return cannot_read(path);
  return S_ISREG(info.st_mode) ? static_cast<uint64_t>(info.st_size) : 0;
}

std::unique_ptr<Source> plain_source(Descriptor file, uint64_t size, const std::string& path) {
  return std::make_unique<FileSource>(std::move(file), size, path);
}

/// Reads to the end, in steps that double: what is allocated stays within twice of what has arrived. From 64
/// KiB on, the size of a pipe's buffer on Linux.
Result<std::vector<std::byte>> read_to_end(int fd, const std::string& name) {
  std::vector<std::byte> bytes;
  size_t used = 0;
  for (;;) {
    if (used == bytes.size()) bytes.resize(std::max<size_t>(size_t{64} << 10, 2 * used));
    const ssize_t got = ::read(fd, bytes.data() + used, bytes.size() - used);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return cannot_read(name);
    if (got == 0) break;
    used += static_cast<size_t>(got);
  }
  bytes.resize(used);
  return bytes;
}

// fstat() asks the file that is open; its name may belong to another file by now.
Result<Descriptor> open_beneath(const std::string& folder, const std::string& name) {
  Descriptor file = MAILLE_TRY(open_anything_beneath(folder, name));
  struct stat info {};
  if (::fstat(file.get(), &info) != 0) return cannot_read(shown(folder, name));
  if (!S_ISREG(info.st_mode)) return not_beneath(folder, name, "it is no regular file");
  return file;
}

Result<std::unique_ptr<Source>> file_source(const std::string& path) {
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.valid()) return cannot_read(path);
  const uint64_t size = MAILLE_TRY(plain_size(file.get(), path));
  // An empty file is read like a pipe, because files below /proc claim to be empty.
  if (size != 0) return plain_source(std::move(file), size, path);
  return memory_source(MAILLE_TRY(read_to_end(file.get(), path)), path);
}

Result<std::unique_ptr<Source>> stdin_source() {
  return memory_source(MAILLE_TRY(read_to_end(STDIN_FILENO, "standard input")), "standard input");
}

}  // namespace maille
