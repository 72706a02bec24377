#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace maille::bench {

/// CPU seconds of this thread: other load on the machine hardly touches it.
double thread_seconds();

/// What a piece of work did in a process of its own, where it may crash, hang or eat memory.
struct Trial {
  bool ok = false;
  std::string problem;      ///< why not: its own message, or the signal that ended it
  uint64_t peak_bytes = 0;  ///< most resident memory during the work, less that before it
};

/// Runs `work` in a forked child. It returns an empty string when all is well.
Trial try_in_child(const std::function<std::string()>& work);

}  // namespace maille::bench
