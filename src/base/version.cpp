#include <maille/version.h>

namespace maille {

const char* library_version() {
  return MAILLE_VERSION;
}

}  // namespace maille
