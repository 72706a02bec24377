#include "base/hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace maille {

// XXH_INLINE_ALL compiles xxhash into this file only: no library to link, and no second copy of its symbols.
uint64_t hash64(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

}  // namespace maille
