#include "io/folder_calls.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <cstdio>

namespace maille {

Descriptor open_folder(const std::string& path) {
  return Descriptor(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
}

Descriptor open_folder_in_use(const std::string& path) {
  Descriptor folder = open_folder(path);
  if (folder.valid()) lock(folder.get());
  return folder;
}

// O_NOFOLLOW: a link, put there by somebody else, must not lead elsewhere.
Descriptor open_unused_folder(const std::string& path) {
  Descriptor folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  if (!folder.valid() || !lock(folder.get())) return Descriptor();
  return folder;
}

bool make_folder(int around, const std::string& name) {
  return ::mkdirat(around, name.c_str(), 0777) == 0;
}

void remove_folder(int around, const std::string& name) {
  ::unlinkat(around, name.c_str(), AT_REMOVEDIR);
}

// O_EXCL: no writer names a file twice, and a link that somebody put here is not followed.
Descriptor make_file(int folder, const std::string& name) {
  return Descriptor(::openat(folder, name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
}

void remove_file(int folder, const std::string& name) {
  ::unlinkat(folder, name.c_str(), 0);
}

// Some file systems cannot sync a folder, and need not.
void sync_folder(int folder) {
  sync(folder);
}

bool rename_folder(const std::string& from, const std::string& to, Descriptor&) {
  return std::rename(from.c_str(), to.c_str()) == 0;
}

}  // namespace maille
