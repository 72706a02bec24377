#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "base/system.h"

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

}  // namespace

uint64_t memory_of_machine() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page <= 0) return 0;
  return std::min(static_cast<uint64_t>(pages) * static_cast<uint64_t>(page), bound_of_container());
}

}  // namespace maille
