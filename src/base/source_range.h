#pragma once

#include <maille/source.h>

#include <string>

namespace maille {

/// Error: cannot_read, if the source does not have these bytes. The comparison avoids offset + size, which
/// could wrap around.
inline Result<> check_range(const Source& source, uint64_t offset, uint64_t size) {
  if (offset <= source.size() && size <= source.size() - offset) return {};
  return failure(ErrorCode::cannot_read,
                 source.name() + ": bytes " + std::to_string(offset) + ".." + std::to_string(offset + size) +
                     " were asked for, but it ends at byte " + std::to_string(source.size()));
}

}  // namespace maille
