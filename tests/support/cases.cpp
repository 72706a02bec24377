#include "support/cases.h"

#include <algorithm>
#include <cstdlib>

namespace maille::testing {
namespace {

bool few() {
#if defined(MAILLE_SANITIZED)
  return std::getenv("MAILLE_ALL_CASES") == nullptr;
#else
  return std::getenv("MAILLE_FEW_CASES") != nullptr;
#endif
}

}  // namespace

uint64_t cases(uint64_t count) {
  return few() ? std::max<uint64_t>(count / 8, 1) : count;
}

uint64_t every(uint64_t step) {
  return few() ? 8 * step - 1 : step;
}

uint32_t large(uint32_t count) {
  return few() ? count / 2 : count;
}

}  // namespace maille::testing
