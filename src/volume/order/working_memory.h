#pragma once

#include <maille/out_of_core.h>

#include <algorithm>
#include <string>

#include "base/result.h"

namespace maille {

/// What tables, pages and parts may take in all: what was asked for, or what the limit leaves beside the
/// process itself.
inline uint64_t working_memory(const WorkingSpace& space) {
  return std::min(space.memory, space.limit - std::min(space.limit, WorkingSpace::of_process));
}

/// Checks a limit before any work is done. Error: memory_bound, where what the process takes with `bytes`
/// more is above the limit; `why` begins the sentence.
inline Result<> check_limit(const WorkingSpace& space, uint64_t bytes, const std::string& why) {
  const uint64_t least = WorkingSpace::of_process + bytes;
  if (least <= space.limit) return {};
  return failure(ErrorCode::memory_bound, why + ": " + std::to_string((least >> 20) + 1) +
                                              " MiB of memory are the least that will do");
}

}  // namespace maille
