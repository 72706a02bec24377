#include "base/unfinished.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>

namespace maille {

/// One open temporary file: its folder and its name there. A signal handler may read it at any moment, hence
/// no allocation and the atomic state.
struct UnfinishedFile {
  std::atomic<bool> taken{false};
  std::atomic<bool> ready{false};
  int folder = -1;
  char name[NAME_MAX + 1] = {};
};

namespace {

// The only global of the library: a signal handler has no other way to know what to remove. A file beyond
// the table's size is written all the same, and merely not removed by remove_unfinished_files().
std::array<UnfinishedFile, 64> unfinished_files;

}  // namespace

UnfinishedRegistration::UnfinishedRegistration(int folder, const std::string& name) {
  for (UnfinishedFile& entry : unfinished_files) {
    if (entry.taken.exchange(true)) continue;
    entry.folder = folder;
    entry.name[name.copy(entry.name, NAME_MAX)] = '\0';
    // This comes last, so that a signal handler never sees half of a name.
    entry.ready = true;
    entry_ = &entry;
    return;
  }
}

UnfinishedRegistration::~UnfinishedRegistration() {
  if (entry_ == nullptr) return;
  entry_->ready = false;
  entry_->taken = false;
}

// Signal handlers call this, so it uses unlinkat(), atomics and fixed memory only.
void remove_unfinished_files() noexcept {
  const int saved = errno;
  for (UnfinishedFile& entry : unfinished_files) {
    if (entry.ready) ::unlinkat(entry.folder, entry.name, 0);
  }
  // Folders are registered before what is in them, the outermost first, and empty now.
  for (size_t i = unfinished_files.size(); i-- > 0;) {
    const UnfinishedFile& entry = unfinished_files[i];
    if (entry.ready) ::unlinkat(entry.folder, entry.name, AT_REMOVEDIR);
  }
  errno = saved;
}

}  // namespace maille
