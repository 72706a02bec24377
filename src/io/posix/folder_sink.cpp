#include "io/folder_sink.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <list>
#include <optional>

#include "base/result.h"
#include "base/system.h"
#include "base/unfinished.h"

namespace maille {
namespace {

namespace fs = std::filesystem;

/// A folder that is removed, if empty, unless it is kept; remove_unfinished_files() (for signals) does so,
/// too. It is held by a descriptor of the folder around it, so that it is found again should somebody rename
/// what is above.
class MadeFolder {
 public:
  static Result<std::unique_ptr<MadeFolder>> make(const std::string& path) {
    const PathParts place = split_path(path);
    auto made = std::make_unique<MadeFolder>(
        Descriptor(::open(place.folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)), place.name);
    if (!made->within_.valid() || ::mkdirat(made->within_.get(), place.name.c_str(), 0777) != 0)
      return cannot_write("folder " + path);
    // Until here the folder may be somebody else's: mkdirat failed, or was not called. Then it must not be
    // removed.
    made->kept_ = false;
    return made;
  }
  MadeFolder(Descriptor within, const std::string& name)
      : within_(std::move(within)), name_(name), registration_(within_.get(), name) {}
  MadeFolder(const MadeFolder&) = delete;
  MadeFolder& operator=(const MadeFolder&) = delete;
  ~MadeFolder() {
    if (!kept_) ::unlinkat(within_.get(), name_.c_str(), AT_REMOVEDIR);
  }
  void keep() { kept_ = true; }

 private:
  Descriptor within_;
  std::string name_;
  UnfinishedRegistration registration_;
  bool kept_ = true;
};

/// A file of the temporary folder, known to remove_unfinished_files() until it is destroyed.
struct PartFile {
  PartFile(std::string file_name, int folder) : name(std::move(file_name)), registration(folder, name) {}
  std::string name;
  UnfinishedRegistration registration;
};

/// Is `entry` the name ".NAME.PID-COUNT.part", which temporary_name() makes, of this NAME? One with ".old"
/// behind it is not: that is an older mesh of the user's, which commit() moved aside.
bool is_temporary_of(const std::string& name, const std::string& entry) {
  const std::string before = "." + name + ".", after = ".part";
  if (entry.size() <= before.size() + after.size() || !entry.starts_with(before) || !entry.ends_with(after))
    return false;
  const std::string middle = entry.substr(before.size(), entry.size() - before.size() - after.size());
  return middle.find_first_not_of("0123456789abcdefx-") == std::string::npos;
}

/// Removes what killed processes left of a folder of this name. A process that writes one holds a lock on it,
/// which ends with the process however it ends, so a folder that can be locked is nobody's. The minute is for
/// one that was made but is not locked yet (chosen; the two calls follow each other at once).
void remove_left_over(const std::string& within, const std::string& name) {
  std::error_code error;
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(within, error)) {
    if (is_temporary_of(name, entry.path().filename().string())) left.push_back(entry.path());
  }
  // O_NOFOLLOW: a link with such a name, put there by somebody else, must not lead remove_all() elsewhere.
  for (const fs::path& path : left) {
    const Descriptor folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (!folder.valid() || ::flock(folder.get(), LOCK_EX | LOCK_NB) != 0) continue;
    const auto age = fs::file_time_type::clock::now() - fs::last_write_time(path, error);
    if (!error && age > std::chrono::minutes(1)) fs::remove_all(path, error);
  }
}

/// Writes files into a temporary folder beside the target, which commit() renames to its name. So at every
/// moment the target is the old mesh, nothing, or the new mesh, whole; "nothing" lasts from one rename to the
/// next, as no system call of POSIX exchanges two folders. The first error of writing is remembered and comes
/// back from all later calls.
class WholeFolder final : public FolderSink {
 public:
  WholeFolder(std::string path, std::vector<std::string> replaced, std::string name)
      : path_(std::move(path)), replaced_(std::move(replaced)), name_(std::move(name)) {}
  WholeFolder(const WholeFolder&) = delete;
  WholeFolder& operator=(const WholeFolder&) = delete;
  ~WholeFolder() override {
    if (committed_) return;
    // On NFS a file that is removed while it is open stays under another name, and its folder with it.
    file_.close();
    for (const PartFile& file : files_) ::unlinkat(folder_.get(), file.name.c_str(), 0);
    while (!made_.empty()) made_.pop_back();  // from the inside out
  }

  Result<> open() {
    const PathParts place = split_path(path_);
    MAILLE_CHECK(make_parents(place.folder));
    remove_left_over(place.folder, place.name);
    temporary_ = place.folder + "/" + temporary_name(place.name);
    made_.push_back(MAILLE_TRY(MadeFolder::make(temporary_)));
    folder_ = Descriptor(::open(temporary_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!folder_.valid()) return cannot_write("folder " + temporary_);
    ::flock(folder_.get(), LOCK_EX | LOCK_NB);  // best effort: some file systems have no locks
    return {};
  }

  Result<> begin_file(const std::string& name) override {
    MAILLE_CHECK(end_file());
    files_.emplace_back(name, folder_.get());
    // O_EXCL: no writer names a file twice, and a link that somebody put here is not followed.
    file_ = Descriptor(::openat(folder_.get(), name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    return file_.valid() ? Result<>() : Result<>(broken(path_ + "/" + name));
  }

  Result<> write(Bytes bytes) override {
    if (broken_) return tl::unexpected(*broken_);
    while (!bytes.empty()) {
      // A write may be cut short by a signal or a full disk; what is left is tried again, and then the error
      // comes.
      const ssize_t written = ::write(file_.get(), bytes.data(), bytes.size());
      if (written < 0 && errno != EINTR) return broken(path_);
      if (written > 0) bytes = bytes.subspan(static_cast<size_t>(written));
    }
    return {};
  }

  Result<> commit() override {
    MAILLE_CHECK(end_file());
    // Some file systems cannot sync a folder, and need not.
    ::fsync(folder_.get());
    std::error_code error;
    const bool there = fs::is_directory(path_, error);
    const std::string older = temporary_ + ".old";
    // rename() replaces a folder only if it is empty, so the older one steps aside first, and comes back if
    // the second rename fails. errno is kept for the message, as the way back changes it.
    if (there && std::rename(path_.c_str(), older.c_str()) != 0) return cannot_write(path_);
    if (std::rename(temporary_.c_str(), path_.c_str()) != 0) {
      const int reason = errno;
      if (there) std::rename(older.c_str(), path_.c_str());
      errno = reason;
      return cannot_write(path_);
    }
    committed_ = true;
    for (const auto& folder : made_) folder->keep();
    return there ? take_over(older) : Result<>();
  }

  std::string name() const override { return name_; }

 private:
  /// Makes what is missing of a path, the outermost first.
  Result<> make_parents(const std::string& path) {
    std::error_code error;
    if (path.empty() || fs::is_directory(path, error)) return {};
    if (const PathParts place = split_path(path); place.folder != path)
      MAILLE_CHECK(make_parents(place.folder));
    made_.push_back(MAILLE_TRY(MadeFolder::make(path)));
    return {};
  }
  Result<> end_file() {
    if (broken_) return tl::unexpected(*broken_);
    if (!file_.valid()) return {};
    if (::fsync(file_.get()) != 0 || !file_.close()) return broken(path_);
    return {};
  }
  tl::unexpected<Error> broken(const std::string& what) {
    broken_ = cannot_write(what).value();
    return tl::unexpected(*broken_);
  }
  /// Moves what the older folder has beside the mesh (other files of the user's) into the new one and removes
  /// the older mesh's own files. What cannot be moved is never deleted: the older folder then stays, and the
  /// error says where.
  Result<> take_over(const std::string& older) {
    std::error_code error;
    // Names are gathered first: what an iterator shows of a folder that changes meanwhile is not specified.
    std::vector<std::string> others;
    for (const auto& entry : fs::directory_iterator(older, error))
      others.push_back(entry.path().filename().string());
    for (const std::string& name : others) {
      const bool gone = std::find(replaced_.begin(), replaced_.end(), name) != replaced_.end();
      if (gone) {
        fs::remove_all(fs::path(older) / name, error);
      } else {
        fs::rename(fs::path(older) / name, fs::path(path_) / name, error);
      }
    }
    if (::rmdir(older.c_str()) == 0) return {};
    return failure(ErrorCode::write_failed,
                   path_ + " is written, but what was in it besides stays in " + older);
  }

  std::string path_;
  std::vector<std::string> replaced_;
  std::string name_, temporary_;
  // From the outside in. Folders that were there before are not in it, and are never removed.
  std::list<std::unique_ptr<MadeFolder>> made_;
  Descriptor folder_, file_;
  std::list<PartFile> files_;
  std::optional<Error> broken_;
  bool committed_ = false;
};

/// The target of a link, without a slash behind it: renaming onto a link would replace the link and leave its
/// target.
std::string plain_path(const std::string& path) {
  std::error_code error;
  const fs::path real = fs::canonical(path, error);
  if (!error) return real.string();
  std::string plain = path;
  while (plain.size() > 1 && plain.back() == '/') plain.pop_back();
  return plain;
}

}  // namespace

Result<std::unique_ptr<FolderSink>> folder_sink(const std::string& path, std::vector<std::string> replaced,
                                                const std::string& name) {
  auto sink = std::make_unique<WholeFolder>(plain_path(path), std::move(replaced), name);
  MAILLE_CHECK(sink->open());
  return std::unique_ptr<FolderSink>(std::move(sink));
}

}  // namespace maille
