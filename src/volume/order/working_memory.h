#pragma once

#include <maille/out_of_core.h>

#include <algorithm>
#include <string>

#include "base/result.h"

namespace maille {

/// For tables, pages and parts, in all.
inline uint64_t working_memory(const WorkingSpace& space) {
  return std::min(space.memory, space.limit - std::min(space.limit, WorkingSpace::of_process));
}

/// What the process takes with `bytes` more. memory_bound, where that is above the limit.
inline Result<> check_limit(const WorkingSpace& space, uint64_t bytes, const std::string& why) {
  const uint64_t least = WorkingSpace::of_process + bytes;
  if (least <= space.limit) return {};
  return failure(ErrorCode::memory_bound, why + ": " + std::to_string((least >> 20) + 1) +
                                              " MiB of memory are the least that will do");
}

}  // namespace maille
