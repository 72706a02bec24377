#pragma once

#include <maille/error.h>
#include <maille/source.h>
#include <string>
#include <vector>

namespace maille::bench {

/// A packer of any bytes, for files as they are.
struct Packer {
  std::string name;
  Result<uint64_t> (*packed_size)(Bytes bytes);
};

/// Those that were there when this was built.
std::vector<Packer> packers();

}  // namespace maille::bench
