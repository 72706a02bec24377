#pragma once

#include <maille/source.h>

#include <string>
#include <utility>

namespace maille {

struct UnfinishedFile;

/// Registers a temporary file for remove_unfinished_files() while it lives. Made before the file is, so that
/// no moment is missed. `folder`: a descriptor, so that chdir() does not matter.
class UnfinishedRegistration {
 public:
  UnfinishedRegistration(int folder, const std::string& name);
  UnfinishedRegistration(UnfinishedRegistration&& other) noexcept
      : entry_(std::exchange(other.entry_, nullptr)) {}
  UnfinishedRegistration& operator=(UnfinishedRegistration&&) = delete;
  ~UnfinishedRegistration();

 private:
  UnfinishedFile* entry_ = nullptr;
};

/// ".NAME.PID-COUNT.part", a name no other file has.
std::string temporary_name(const std::string& name);

}  // namespace maille
