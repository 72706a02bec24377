#pragma once

#include <maille/error.h>
#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace maille::tool {

/// A file that is served, open.
struct ServedFile {
  int descriptor = -1;
  uint64_t size = 0;
  std::string type;           ///< of its content, by its extension
  std::string etag;           ///< strong: of size, time and inode
  std::string last_modified;  ///< as HTTP writes dates

  ServedFile() = default;
  ServedFile(const ServedFile&) = delete;
  ServedFile& operator=(const ServedFile&) = delete;
  ~ServedFile();
  /// Bytes read; 0 at the end, negative for an error.
  ssize_t read(uint64_t offset, char* out, size_t size) const;
};

/// What `maille serve` gives: files below a folder, or one file.
class ServedFiles {
 public:
  /// Error: cannot_read.
  static Result<ServedFiles> open(const std::string& path);

  /// The file of a path of an address ("/a/b.maille"). Nothing for what is not there, is no file, has a name
  /// that begins with a dot, or lies elsewhere: links that lead out of the folder are not followed.
  std::shared_ptr<ServedFile> file(const std::string& path) const;
  bool is_folder(const std::string& path) const { return only_.empty() && find(path, true); }
  /// A page with links to what a folder holds; `viewer`: where .maille files can be looked at, or nothing.
  std::string page(const std::string& path, const std::string& viewer) const;
  /// The name of the only file; empty where it is a folder.
  const std::string& only() const { return only_; }

 private:
  std::optional<std::string> find(const std::string& path, bool folder) const;
  std::vector<std::string> names_in(const std::string& path) const;

  std::string root_;  ///< without links, "/" only at the front
  std::string only_;
};

/// As addresses write it: what is special, as %XX.
std::string url_encoded(const std::string& text);

}  // namespace maille::tool
