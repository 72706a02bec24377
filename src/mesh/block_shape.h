#pragma once

#include <maille/mesh.h>

#include <cstdint>

namespace maille {

/// What a description says about a block before its cells are decoded. `cells` is a claim until then: whoever
/// reserves memory by it must know that the bytes are there.
struct BlockShape {
  CellType type = CellType::polygon;
  uint64_t cells = 0;
};

}  // namespace maille
