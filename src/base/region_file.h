#pragma once

#include <maille/source.h>

#include <optional>
#include <string>

#include "base/posix.h"
#include "base/unfinished.h"

namespace maille {

/// A file that appears whole or not at all, as of file_sink(), but written at any place.
class RegionFile {
 public:
  explicit RegionFile(std::string path) : path_(std::move(path)) {}
  ~RegionFile();
  RegionFile(const RegionFile&) = delete;
  RegionFile& operator=(const RegionFile&) = delete;

  Result<> open();
  Result<> write_at(uint64_t offset, Bytes bytes);
  /// Makes the file durable and visible.
  Result<> commit();
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  PathParts place_;
  std::string temporary_;
  Descriptor folder_, file_;
  std::optional<UnfinishedRegistration> registration_;
  bool committed_ = false;
};

}  // namespace maille
