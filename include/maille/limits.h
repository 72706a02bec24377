#pragma once

#include <cstdint>

namespace maille {

/// What a caller allows a decoder or reader to use. Reaching a limit is an error (memory_bound), never a
/// crash.
struct Limits {
  /// Bytes of decoded mesh. The default is 64 GiB; set it for input you do not trust.
  uint64_t mesh_bytes = uint64_t{64} << 30;
};

}  // namespace maille
