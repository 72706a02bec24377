#include <fcntl.h>
#include <sys/syscall.h>
#include <cstdlib>
#include <memory>

#if __has_include(<linux/openat2.h>)
#include <linux/openat2.h>
#endif

#include "base/system.h"

namespace maille {
namespace {

// Without O_NONBLOCK, opening a pipe would wait for a writer before fstat() can refuse it.
constexpr int opening_flags = O_RDONLY | O_CLOEXEC | O_NONBLOCK;

/// What the kernel itself keeps within the folder. Not there (before Linux 5.6, in some containers, on other
/// systems): -1 with errno ENOSYS.
int open_by_kernel([[maybe_unused]] int folder, [[maybe_unused]] const std::string& name) {
#ifdef SYS_openat2
  open_how how{};
  how.flags = opening_flags;
  // Links below /proc/self/fd lead to files without naming their paths, so they are refused as well.
  how.resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS;
  const long file = ::syscall(SYS_openat2, folder, name.c_str(), &how, sizeof how);
  // Containers whose filters do not know the call answer EPERM.
  if (file >= 0 || errno != EPERM) return static_cast<int>(file);
#endif
  errno = ENOSYS;
  return -1;
}

std::string real_path(const std::string& path) {
  const std::unique_ptr<char, decltype(&std::free)> real(::realpath(path.c_str(), nullptr), std::free);
  return real ? std::string(real.get()) : std::string();
}

/// The same where the kernel does not help: somebody who changes links at this moment is not noticed.
/// realpath() and open() are two calls; O_NOFOLLOW narrows the gap to the folders of the path.
int open_by_path(const std::string& folder, const std::string& name) {
  const std::string file = real_path(folder + "/" + name), root = real_path(folder);
  if (file.empty() || root.empty()) return -1;
  if (file.starts_with(root == "/" ? root : root + "/"))
    return ::open(file.c_str(), opening_flags | O_NOFOLLOW);
  errno = EXDEV;
  return -1;
}

}  // namespace

Descriptor open_within(const std::string& folder, const std::string& name) {
  const Descriptor root(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!root.valid()) return Descriptor();
  const int file = open_by_kernel(root.get(), name);
  return Descriptor(file < 0 && errno == ENOSYS ? open_by_path(folder, name) : file);
}

}  // namespace maille
