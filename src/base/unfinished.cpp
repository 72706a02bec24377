#include "base/unfinished.h"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <string_view>

namespace maille {

std::string temporary_name(const std::string& name) {
  static std::atomic<unsigned> count{0};
  const auto now =
      static_cast<unsigned long long>(std::chrono::steady_clock::now().time_since_epoch().count());
  char tail[64];
  std::snprintf(tail, sizeof tail, ".%ld-%x%08llx.part", static_cast<long>(::getpid()), count++,
                now & 0xffffffffu);
  constexpr size_t longest_name = 255;  // of Linux, macOS and Windows
  // Long names are cut off, so that the whole still fits a directory entry.
  return "." + name.substr(0, longest_name - 1 - std::string_view(tail).size()) + tail;
}

}  // namespace maille
