#pragma once

#include <maille/executor.h>
#include <maille/limits.h>

#include <algorithm>
#include <string>

#include "base/result.h"

namespace maille {

/// What a reader may still allocate, in bytes. A hostile file names the same bytes many times (glTF
/// accessors, arrays that are padded), so besides the caller's limit a file may not grow more than 64-fold
/// beyond a floor of 64 MiB. Triangle strips with one-byte indices, the widest honest case, grow 16-fold; 64
/// was chosen four times as wide as that, not swept. The floor lets small files through whatever they hold.
class Budget {
 public:
  Budget(std::string file, uint64_t file_bytes, const Limits& limits)
      : file_(std::move(file)), limit_(limits.mesh_bytes) {
    const uint64_t factor = 64, floor = uint64_t{64} << 20;
    if (file_bytes < (UINT64_MAX - floor) / factor) plausible_ = floor + factor * file_bytes;
  }

  /// Call this before allocating. Nothing is given back: the sum counts what was taken in the whole run of a
  /// reader. The comparison divides instead of multiplying, so that hostile counts cannot overflow. Errors:
  /// memory_bound where the caller's limit is the lower one, else malformed_input.
  Result<> take(uint64_t count, uint64_t bytes_each) {
    const uint64_t most = std::min(limit_, plausible_);
    if (count <= (most - used_) / std::max<uint64_t>(bytes_each, 1)) {
      used_ += count * bytes_each;
      return {};
    }
    // Which of the two bounds is lower decides what the user can do about it.
    if (limit_ <= plausible_) {
      return failure(ErrorCode::memory_bound,
                     file_ + ": the mesh needs more than the " + std::to_string(limit_) +
                         " bytes allowed; raise the memory limit if you trust the file");
    }
    return failure(ErrorCode::malformed_input,
                   file_ + ": its counts describe more than " + std::to_string(plausible_) +
                       " bytes of mesh, far beyond what a file of this size can hold");
  }

 private:
  std::string file_;
  uint64_t limit_;
  uint64_t plausible_ = UINT64_MAX;
  uint64_t used_ = 0;
};

/// Tells the caller how far reading has come; the error is cancelled.
inline Result<> report_progress(const Progress& progress, const char* stage, double fraction) {
  if (!progress || progress({stage, fraction})) return {};
  return failure(ErrorCode::cancelled, std::string("cancelled while ") + stage);
}

}  // namespace maille
