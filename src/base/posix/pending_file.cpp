#include "base/pending_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>

#include "base/result.h"

namespace maille {
namespace {

/// The file a symbolic link leads to, so that writing through a link keeps the link.
std::string resolve_link(const std::string& path) {
  struct stat info {};
  if (::lstat(path.c_str(), &info) != 0 || !S_ISLNK(info.st_mode)) return path;
  char* const resolved = ::realpath(path.c_str(), nullptr);
  const std::string target = resolved == nullptr ? path : resolved;
  std::free(resolved);
  return target;
}

/// What linkat() takes for a file without a name; AT_EMPTY_PATH needs more rights.
std::string link_to(int fd) {
  return "/proc/self/fd/" + std::to_string(fd);
}

}  // namespace

PendingFile::PendingFile(const std::string& path) : path_(path), place_(split_path(resolve_link(path))) {}

PendingFile::~PendingFile() {
  if (!committed_ && !temporary_.empty()) ::unlinkat(folder_.get(), temporary_.c_str(), 0);
}

Result<std::unique_ptr<PendingFile>> PendingFile::create(const std::string& path,
                                                         std::optional<unsigned> permissions, Naming naming) {
  std::unique_ptr<PendingFile> file(new PendingFile(path));
  MAILLE_CHECK(file->open(permissions.value_or(0666), naming));
  // open() takes away what the umask forbids; a file that replaces another one keeps the permissions of that.
  if (permissions)
    ::fchmod(file->descriptor(),
             static_cast<mode_t>(*permissions));  // best effort: some file systems have no modes
  return file;
}

// The folder stays open, and the name is given within it at the end, wherever chdir() or a rename has led
// meanwhile.
Result<> PendingFile::open(unsigned permissions, Naming naming) {
  const std::string what = path_ + ": folder " + place_.folder;
  folder_ = Descriptor(::open(place_.folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder_.valid()) return cannot_write(what);
  if (naming == Naming::late) open_without_name(permissions);
  if (file_.valid() || open_named(permissions)) return {};
  return cannot_write(what);
}

void PendingFile::open_without_name([[maybe_unused]] unsigned permissions) {
#ifdef O_TMPFILE
  Descriptor file(::openat(folder_.get(), ".", O_TMPFILE | O_WRONLY | O_CLOEXEC, permissions));
  // Without /proc it could never get a name.
  if (file.valid() && ::access(link_to(file.get()).c_str(), F_OK) == 0) file_ = std::move(file);
#endif
}

bool PendingFile::open_named(unsigned permissions) {
  // O_EXCL never opens a file that somebody else has made, so names are tried until one is free.
  // Names differ by process, count and time, so that a second attempt is rare; 100 bounds the loop where a
  // file system says EEXIST to everything.
  for (int attempt = 0; attempt < 100; ++attempt) {
    choose_temporary_name();
    file_ = Descriptor(
        ::openat(folder_.get(), temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, permissions));
    if (file_.valid()) return true;
    const int reason = errno;
    registration_.reset();
    temporary_.clear();
    errno = reason;
    if (reason != EEXIST) return false;
  }
  return false;
}

void PendingFile::choose_temporary_name() {
  temporary_ = temporary_name(place_.name);
  registration_.emplace(folder_.get(), temporary_);
}

bool PendingFile::link_as(const std::string& name) const {
  const std::string from = link_to(file_.get());
  return ::linkat(AT_FDCWD, from.c_str(), folder_.get(), name.c_str(), AT_SYMLINK_FOLLOW) == 0;
}

/// A link never replaces a file, so that this takes a moment under a temporary name.
bool PendingFile::give_name() {
  if (temporary_.empty()) {
    if (link_as(place_.name)) return true;
    if (errno != EEXIST) return false;
    choose_temporary_name();
    if (!link_as(temporary_)) return false;
    // Some file systems (NFS) tell only at close() that bytes were lost, so it comes before the name.
  } else if (!file_.close()) {
    return false;
  }
  return ::renameat(folder_.get(), temporary_.c_str(), folder_.get(), place_.name.c_str()) == 0;
}

// The bytes become durable first, then the name, then the folder that holds the name. After a loss of power
// there is either the old file or the whole new one (tests/faults plays this).
Result<> PendingFile::commit() {
  if (committed_) return {};
  if (!sync(file_.get()) || !give_name()) return cannot_write(path_);
  committed_ = true;
  // Some file systems cannot sync a folder, and need not.
  if (sync(folder_.get()) || errno == EINVAL || errno == ENOTSUP) return {};
  return failure(ErrorCode::write_failed,
                 path_ + " is written but may not survive a power loss: its folder cannot be synced: " +
                     std::strerror(errno));
}

}  // namespace maille
