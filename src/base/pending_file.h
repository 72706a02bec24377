#pragma once

#include <maille/source.h>

#include <memory>
#include <optional>
#include <string>

#include "base/system.h"
#include "base/unfinished.h"

namespace maille {

/// A file that appears under its name whole or not at all. While it is written it has no name where the file
/// system can do that, so that nothing is left however the process ends; elsewhere a temporary one, which
/// remove_unfinished_files() knows.
class PendingFile {
 public:
  enum class Naming : uint8_t {
    late,   ///< none before commit(), where that can be
    early,  ///< a temporary one, as on file systems that have no files without names
  };
  /// Through a symbolic link, if `path` is one. `permissions`: exactly these, not the usual ones.
  static Result<std::unique_ptr<PendingFile>> create(const std::string& path,
                                                     std::optional<unsigned> permissions = {},
                                                     Naming naming = Naming::late);
  ~PendingFile();
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;

  int descriptor() const { return file_.get(); }
  const std::string& path() const { return path_; }
  /// Makes the file durable and visible; what had the name is replaced. Once.
  Result<> commit();

 private:
  explicit PendingFile(const std::string& path);
  Result<> open(unsigned permissions, Naming naming);
  void open_without_name(unsigned permissions);
  bool open_named(unsigned permissions);
  void choose_temporary_name();
  bool link_as(const std::string& name) const;
  bool give_name();

  std::string path_, temporary_;
  PathParts place_;
  Descriptor folder_, file_;
  std::optional<UnfinishedRegistration> registration_;
  bool committed_ = false;
};

}  // namespace maille
