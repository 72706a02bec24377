#include <maille/limits.h>

#include "base/system.h"

namespace maille {
namespace {

/// The limit is half of the memory, because whoever decodes a mesh mostly has other things in memory, too. A
/// machine that does not tell its memory is taken to have 128 GiB.
uint64_t half_of_machine() {
  // What has addresses of 32 bits can use no more, and a web page cannot ask its machine.
  if constexpr (sizeof(void*) == 4) return uint64_t{2} << 30;
  const uint64_t machine = memory_of_machine();
  return machine != 0 ? machine / 2 : uint64_t{64} << 30;
}

}  // namespace

uint64_t default_mesh_bytes() {
  // The limit is found once. If it changed while a program runs, the same call could succeed and then fail.
  static const uint64_t limit = half_of_machine();
  return limit;
}

}  // namespace maille
