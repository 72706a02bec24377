#pragma once

#include <maille/source.h>

#include <memory>
#include <string>

#include "base/pending_file.h"

namespace maille {

/// A file that appears whole or not at all, as of file_sink(), but written at any place: for formats
/// whose sections grow side by side (VTU, Gmsh). Places that were never written are zeros.
class RegionFile {
 public:
  explicit RegionFile(std::string path) : path_(std::move(path)) {}

  Result<> open();
  Result<> write_at(uint64_t offset, Bytes bytes);
  /// Makes the file durable and visible.
  Result<> commit() { return file_->commit(); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::unique_ptr<PendingFile> file_;
};

}  // namespace maille
