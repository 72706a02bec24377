#include <maille/limits.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace maille {
namespace {

/// Of the container: cgroups v2, v1. "max", or no such file: no bound.
uint64_t bound_of_container() {
  uint64_t bound = UINT64_MAX;
  for (const char* path : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    std::FILE* const file = std::fopen(path, "re");
    if (file == nullptr) continue;
    unsigned long long bytes = 0;
    if (std::fscanf(file, "%llu", &bytes) == 1 && bytes > 0) bound = std::min<uint64_t>(bound, bytes);
    std::fclose(file);
  }
  return bound;
}

/// The limit is half of the memory, because whoever decodes a mesh mostly has other things in memory, too. A
/// machine that does not tell its memory is taken to have 128 GiB.
uint64_t half_of_machine() {
  // What has addresses of 32 bits can use no more, and a web page cannot ask its machine.
  if constexpr (sizeof(void*) == 4) return uint64_t{2} << 30;
  const long pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
  const uint64_t machine = pages > 0 && page > 0 ? static_cast<uint64_t>(pages) * static_cast<uint64_t>(page)
                                                 : uint64_t{128} << 30;
  return std::min(machine, bound_of_container()) / 2;
}

}  // namespace

uint64_t default_mesh_bytes() {
  // The limit is found once. If it changed while a program runs, the same call could succeed and then fail.
  static const uint64_t limit = half_of_machine();
  return limit;
}

}  // namespace maille
