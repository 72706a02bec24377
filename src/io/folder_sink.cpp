#include "io/folder_sink.h"

#include <maille/path.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <list>
#include <optional>

#include "base/result.h"
#include "base/unfinished.h"
#include "io/folder_calls.h"

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
    auto made = std::make_unique<MadeFolder>(open_folder(place.folder), place.name);
    if (!made->within_.valid() || !make_folder(made->within_.get(), place.name))
      return cannot_write("folder " + path);
    // Until here the folder may be somebody else's: then it must not be removed.
    made->kept_ = false;
    return made;
  }
  MadeFolder(Descriptor within, const std::string& name)
      : within_(std::move(within)), name_(name), registration_(within_.get(), name) {}
  MadeFolder(const MadeFolder&) = delete;
  MadeFolder& operator=(const MadeFolder&) = delete;
  ~MadeFolder() {
    if (!kept_) remove_folder(within_.get(), name_);
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
  for (const auto& entry : fs::directory_iterator(to_path(within), error)) {
    if (is_temporary_of(name, to_utf8(entry.path().filename()))) left.push_back(entry.path());
  }
  for (const fs::path& path : left) {
    const Descriptor folder = open_unused_folder(to_utf8(path));
    if (!folder.valid()) continue;
    const auto age = fs::file_time_type::clock::now() - fs::last_write_time(path, error);
    if (!error && age > std::chrono::minutes(1)) fs::remove_all(path, error);
  }
}

/// Writes files into a temporary folder beside the target, which commit() renames to its name. So at every
/// moment the target is the old mesh, nothing, or the new mesh, whole; "nothing" lasts from one rename to the
/// next, as no system call of POSIX or Windows exchanges two folders. The first error of writing is
/// remembered and comes back from all later calls.
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
    for (const PartFile& file : files_) remove_file(folder_.get(), file.name);
    folder_ = Descriptor();
    while (!made_.empty()) made_.pop_back();  // from the inside out
  }

  Result<> open() {
    const PathParts place = split_path(path_);
    MAILLE_CHECK(make_parents(place.folder));
    remove_left_over(place.folder, place.name);
    temporary_ = place.folder + "/" + temporary_name(place.name);
    made_.push_back(MAILLE_TRY(MadeFolder::make(temporary_)));
    folder_ = open_folder_in_use(temporary_);
    return folder_.valid() ? Result<>() : Result<>(cannot_write("folder " + temporary_));
  }

  Result<> begin_file(const std::string& name) override {
    MAILLE_CHECK(end_file());
    files_.emplace_back(name, folder_.get());
    file_ = make_file(folder_.get(), name);
    return file_.valid() ? Result<>() : Result<>(broken(path_ + "/" + name));
  }

  Result<> write(Bytes bytes) override {
    if (broken_) return tl::unexpected(*broken_);
    return write_all(file_.get(), bytes) ? Result<>() : Result<>(broken(path_));
  }

  Result<> commit() override {
    MAILLE_CHECK(end_file());
    sync_folder(folder_.get());
    std::error_code error;
    const bool there = fs::is_directory(to_path(path_), error);
    const std::string older = temporary_ + ".old";
    Descriptor none;
    // A folder replaces another one only if that is empty, so the older one steps aside first, and comes back
    // if the second rename fails. errno is kept for the message, as the way back changes it.
    if (there && !rename_folder(path_, older, none)) return cannot_write(path_);
    if (!rename_folder(temporary_, path_, folder_)) {
      const int reason = errno;
      if (there) rename_folder(older, path_, none);
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
    if (path.empty() || fs::is_directory(to_path(path), error)) return {};
    if (const PathParts place = split_path(path); place.folder != path)
      MAILLE_CHECK(make_parents(place.folder));
    made_.push_back(MAILLE_TRY(MadeFolder::make(path)));
    return {};
  }
  Result<> end_file() {
    if (broken_) return tl::unexpected(*broken_);
    if (!file_.valid()) return {};
    if (!sync(file_.get()) || !file_.close()) return broken(path_);
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
    std::vector<fs::path> others;
    for (const auto& entry : fs::directory_iterator(to_path(older), error)) others.push_back(entry.path());
    for (const fs::path& other : others) {
      const fs::path name = other.filename();
      if (std::find(replaced_.begin(), replaced_.end(), to_utf8(name)) != replaced_.end()) {
        fs::remove_all(other, error);
      } else {
        fs::rename(other, to_path(path_) / name, error);
      }
    }
    if (fs::remove(to_path(older), error)) return {};
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
  const fs::path real = fs::canonical(to_path(path), error);
  if (!error) return to_utf8(real);
  std::string plain = to_utf8(to_path(path));
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
