#pragma once

#include <cstdint>

namespace maille {

/// Half of what the machine has, or its container may have; 2 GiB where addresses have 32 bits.
uint64_t default_mesh_bytes();

/// What a caller allows a decoder or reader to use. Reaching a limit is an error (memory_bound), never a
/// crash.
struct Limits {
  /// Bytes that decoding may take at its peak, but for 8 MiB: the mesh, what is made of it, and what the
  /// decoder keeps meanwhile (points that are used again, the cells around them, models of arrays). Modes
  /// single and random know an upper bound before they begin, which for usual meshes is up to four times what
  /// they take. Of readers of other formats and of encoders: bytes of the mesh. The default is below what the
  /// machine has, so that a file of few bytes that decodes to a mesh without end is an error before the
  /// machine stands still.
  uint64_t mesh_bytes = default_mesh_bytes();
};

}  // namespace maille
