#pragma once

#include <set>
#include <string>
#include <string_view>

namespace maille::testing {

/// An empty folder for a test, gone with all that is in it when the object is. Names are below the folder.
class TemporaryFolder {
 public:
  TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder();

  const std::string& path() const { return path_; }
  std::string path(const std::string& name) const { return path_ + "/" + name; }
  /// Writes a file, and gives its path.
  std::string write(const std::string& name, std::string_view bytes) const;
  /// The bytes of a file; none where there is no such file.
  std::string read(const std::string& name) const;
  /// What is in it, hidden files too.
  std::set<std::string> names() const;

 private:
  std::string path_;
};

}  // namespace maille::testing
