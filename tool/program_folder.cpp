#include "program_folder.h"

#include <cstdlib>

namespace maille::tool {

std::string program_folder() {
#ifdef __linux__
  char* const found = ::realpath("/proc/self/exe", nullptr);
  if (found == nullptr) return {};
  const std::string path = found;
  std::free(found);
  return path.substr(0, path.rfind('/'));
#else
  return {};
#endif
}

}  // namespace maille::tool
