#include "base/hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace maille {

// XXH_INLINE_ALL compiles xxhash into this file, so there is no library to link and no clash of symbols.
uint64_t hash64(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

}  // namespace maille
