#include "support/cases.h"

#include <algorithm>
#include <cstdlib>

namespace maille::testing {

uint64_t cases(uint64_t count) {
#if defined(MAILLE_SANITIZED)
  if (std::getenv("MAILLE_ALL_CASES") == nullptr) return std::max<uint64_t>(count / 4, 1);
#endif
  return count;
}

}  // namespace maille::testing
